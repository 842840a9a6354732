#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compensation/actual_chain.h"
#include "compensation/fit/ballbar.h"

namespace trn {

/// One error of the machine, or of the set-up, that a fit may find.
struct BallbarParameter {
  enum class Kind : unsigned char { kOffset, kTilt, kBall, kCup };
  std::string name;  ///< as in the config: "C.ex0", "A.eb0"; "ball of a.x", "cup.y"
  Kind kind = Kind::kOffset;
  int joint = 0;         ///< the axis; of a ball, the axis of its tests
  int component = 0;     ///< 0 to 2: along or about x, y, z
  double value = 0;      ///< mm or rad
  double deviation = 0;  ///< standard error of the value
  std::string unknown;   ///< why the readings cannot tell it; "" if it was fitted
};

struct BallbarFit {
  std::vector<BallbarParameter> parameters;  ///< errors first, then set-up
  std::vector<int> fitted;                   ///< numbers of those that were fitted
  Eigen::MatrixXd correlation;               ///< of the fitted ones
  double rms_mm = 0;                         ///< of the residuals
  double condition = 0;                      ///< of the Jacobian, lengths in mm and tilts in mm at 100 mm
  std::vector<double> before_mm, after_mm;   ///< by trace: peak to peak of readings and residuals
};

struct BallbarFitOptions {
  bool fit_setup = true;  ///< set-up offsets of ball and cup as further unknowns, where they can be told
  std::optional<double> noise_mm;  ///< of one reading; unknown: from the residuals
};

/// Fits the errors of the two rotary axes of the table jointly to all traces, on the exact chain `nominal`
/// (its own locations are the start). std::runtime_error when the traces cannot tell an error, or
/// have a number that is not finite.
BallbarFit fit_ballbar(const ActualChain& nominal, const std::vector<BallbarTrace>& traces,
                       const BallbarFitOptions& options);

/// The planar method of docs/sources.md S1.7: the centre of the circle at two places along each axis; offset
/// = mean of the two, tilt = difference over distance. Wants the traces a_left, a_right, c_low, c_high.
BallbarFit fit_planar(const ActualChain& nominal, const std::vector<BallbarTrace>& traces);

}  // namespace trn

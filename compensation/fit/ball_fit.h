#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compensation/actual_chain.h"
#include "core/axes.h"
#include "core/frames.h"

namespace trn {

/// A touch of a ball on the table by the stylus in the spindle.
struct BallContact {
  JointVec q;                    ///< the joints at the touch, mm or rad
  Vec3 stylus_S = Vec3::Zero();  ///< centre of the stylus' ball from the spindle nose, in its frame, mm
};

/// What a fit may find: an error of a rotary axis (ISO 230-1), or where ball and stylus really are.
struct BallParameter {
  enum class Kind : unsigned char { kBall, kRadius, kOffset, kTilt, kStylus };
  std::string name;  ///< "ball.x", "ball.radius", "A.ey0", "A.eb0", "stylus.z"
  Kind kind = Kind::kBall;
  int joint = -1;        ///< of an axis
  int component = 0;     ///< 0 to 2: along or about x, y, z
  double value = 0;      ///< mm or rad
  double deviation = 0;  ///< standard error of the value, from the scatter of the contacts
  std::string unknown;   ///< why the contacts do not tell it; "" if it was fitted
};

struct BallFit {
  std::vector<BallParameter> parameters;  ///< ball, axes from the base outwards, stylus
  std::vector<int> fitted;                ///< numbers of those that were fitted
  Eigen::MatrixXd correlation;            ///< of the fitted ones
  double noise_mm = 0;              ///< of one touch: from the residuals, less the freedom that the fit took
  double before_mm = 0;             ///< rms distance from one sphere on the machine as it was known
  double condition = 0;             ///< of the Jacobian, lengths in mm and tilts in mm at 100 mm
  std::vector<double> residual_mm;  ///< by contact
};

/// How far the stylus' ball is from touching: distance of the two centres less `reach_mm`, the sum of their
/// radii; on the machine `chain`, with the ball's centre at `ball_B`.
double ball_gap(const ActualChain& chain, const BallContact& contact, const Vec3& ball_B, double reach_mm);

/// Fits the errors of all rotary axes jointly to all contacts on the exact chain `known`, whose own errors
/// are the start; with them the ball's centre and the sum of the radii, which nobody need know. Errors that
/// the contacts cannot tell keep their value and say why. std::runtime_error: too few contacts, or no ball in
/// them.
BallFit fit_ball(const ActualChain& known, const std::vector<BallContact>& contacts);

/// What positions are worth: the covariance of the parameters at contacts that are planned, with `noise_mm` a
/// touch. Nothing is known beforehand better than 1 mm (tilts at 100 mm), so that few contacts have an
/// answer.
class BallInformation {
 public:
  /// Ball at `ball_B`, mm, in the table.
  BallInformation(const ActualChain& known, const Vec3& ball_B, double reach_mm, double noise_mm);
  void add(const std::vector<BallContact>& contacts);
  /// Standard errors of `parameters`, mm or rad; with more contacts on top.
  std::vector<double> deviations(const std::vector<BallContact>& more = {}) const;
  /// Root of the mean square of the axes' standard errors, mm; tilts at 100 mm.
  double axes_mm(const std::vector<BallContact>& more = {}) const;
  const std::vector<BallParameter>& parameters() const { return parameters_; }

 private:
  Eigen::MatrixXd information_of(const std::vector<BallContact>& contacts) const;
  Eigen::VectorXd variances(const std::vector<BallContact>& more) const;

  const ActualChain& known_;
  double noise_mm_;
  std::vector<BallParameter> parameters_;
  Eigen::MatrixXd information_;
};

}  // namespace trn

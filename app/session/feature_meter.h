#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "core/frames.h"
#include "interp/move.h"
#include "kernel/rt_messages.h"

namespace trn {

/// What the tool's bending makes of one programmed feature: a full circle (of one arc or of several) or a
/// straight cut in the XY plane.
struct FeatureDeflection {
  std::uint32_t line = 0, last_line = 0;  ///< source lines
  bool circle = false;
  double size_mm = 0;     ///< programmed: diameter of the path of the tool's middle, or length
  double offset_mm = 0;   ///< mean of bending and correction: outward from a circle's middle, or to the left
  double bending_mm = 0;  ///< of it, the tool's bending alone
  double unknown = 0;     ///< share of the time in which the load was not known

  /// Diameter that the middle of the tool really goes round: all a circle's cut is so much larger.
  double predicted_mm() const { return circle ? size_mm + 2 * offset_mm : size_mm; }
};

/// Averages the estimated deflection over every feature of a program (docs/sources.md S5.5).
class FeatureMeter {
 public:
  static constexpr double kLengthMin = 1;               ///< of a straight cut, mm
  static constexpr std::size_t kFeaturesMax = 100'000;  ///< of one program; later ones are not measured

  void programmed(const ProgramMove& move);
  void sample(const CycleReport& report);
  /// In program order; circles that are not closed and what was never driven are left out.
  std::vector<FeatureDeflection> features() const;

 private:
  struct Feature {
    FeatureDeflection result;
    Vec3 centre = Vec3::Zero(), left = Vec3::Zero();
    double sweep_rad = 0, offset_sum_mm = 0, bending_sum_mm = 0;
    std::uint64_t periods = 0, unknown = 0;
  };
  void arc(const ProgramMove& move);

  std::deque<Feature> features_;
  std::size_t at_ = 0;
};

}  // namespace trn

#pragma once

#include <cstddef>
#include <optional>
#include <stdexcept>
#include <vector>

#include "app/lab/tune/tune_data.h"
#include "core/axes.h"
#include "core/joint_model.h"

namespace trn {

/// The joint's drive does not tell its torque; what() says what would be right.
struct NoTorque : std::runtime_error {
  explicit NoTorque(const Joint& joint);
};

/// A number and its standard deviation.
struct TuneValue {
  double value = 0, deviation = 0;
};

/// The model of a joint by least squares. Linear joints in N and mm, rotary ones in Nm and rad.
struct TuneFit {
  TuneValue inertia, viscous, coulomb, gravity;
  TuneValue imbalance_cos, imbalance_sin;           ///< of a rotary joint that turned far enough; else 0
  double cogging_pitch = 0;                         ///< mm or rad; 0: none was asked for
  std::vector<TuneValue> cogging_cos, cogging_sin;  ///< of one wave in a pitch, of two and so on
  double residual = 0;                              ///< rms of what the model does not explain, N or Nm
  double explained = 0;                             ///< share of the force's variance, 0 to 1
  std::size_t rows = 0;

  JointModel model(double coulomb_speed) const;
  /// Of the cogging alone, N or Nm.
  double cogging_at(double q) const;
  /// One of its waves is beyond doubt.
  bool cogs() const;
};

/// Fits force = inertia a + viscous v + coulomb sign(v) + weight to what was measured. Both sides pass the
/// same smooth window, so that the noise of differences costs no accuracy. Deviations are by strokes, which
/// are independent of each other as neighbouring periods are not. std::runtime_error where the data cannot
/// tell. `cogging_pitch`: mm or rad after which cogging repeats, to be fitted as well; 0: it is not.
TuneFit fit_joint(const TuneData& data, const Joint& joint, double cogging_pitch = 0);

/// So many waves in a pitch are looked for.
inline constexpr int kCoggingWavesMax = 8;

/// Way of the motor, from where it turns round, until it meets the friction of the other direction: play and
/// wind-up together, mm or rad, over the strokes from `first_slow` on. Nothing: the joint has no friction
/// that could tell, or it is held on one side by its weight.
std::optional<TuneValue> lost_motion(const TuneData& data, const TuneFit& fit, std::size_t first_slow);

}  // namespace trn

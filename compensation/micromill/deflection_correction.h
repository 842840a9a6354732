#pragma once

#include "compensation/micromill/deflection_estimator.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/ports.h"

namespace trn {

/// Innovation, times that of the training runs, from which on the model counts as wrong, unless the config
/// says otherwise: half as much again as the largest on stages that are as they were learnt
/// (docs/micromill.md).
inline constexpr double kInnovationAlarm = 7;

/// Estimates the bending of the tool in every period and, with a gain, moves the path against it: the
/// estimate through a low pass and a limited rate. The first two joints are the stage's X and Y. A deeper cut
/// bends the tool more, which is fed back: correction_margins says how far from unstable that is.
class DeflectionCorrection final : public SetpointCorrection {
 public:
  struct Config {
    DeflectionEstimator::Config estimator;
    bool trained = true;   ///< false: the networks are unknown; loads are reported, nothing is corrected
    double gain = 0;       ///< share of the estimated deflection that is made good; 0: off
    double lag_s = 0.05;   ///< of the low pass
    double rate_mm_s = 1;  ///< fastest change of the shift
    double period_s = 0;
  };

  explicit DeflectionCorrection(const Config& config);

  void wanted(const CorrectionInput& input, JointVec& offset) TRN_RT override;
  unsigned joint_mask() const override { return 3; }
  const char* warning() const TRN_RT override;

  const DeflectionEstimator::Output& estimate() const TRN_RT { return out_; }
  const Config& config() const { return config_; }

 private:
  Config config_;
  DeflectionEstimator estimator_;
  DeflectionEstimator::State state_;
  DeflectionEstimator::Output out_;
  Eigen::Vector2d smooth_mm_ = Eigen::Vector2d::Zero(), shift_mm_ = Eigen::Vector2d::Zero();
  double share_ = 0;
  bool told_ = false;  ///< the drives told the current
};

/// Stability of the correction around the cutting process. A shift deepens the cut; the process answers with
/// a deflection of `process` times the shift (process stiffness over process plus tool stiffness, below 1 for
/// any work). |L| = process * gain * low pass * chain's filter * load filter * servo, over all frequencies.
struct CorrectionMargins {
  double loop_gain_max = 0;  ///< below 1: stable whatever the phase (small-gain theorem)
  double gain_margin = 0;    ///< 1 / loop_gain_max
  /// Turn of L that is left up to 1, where |L| >= 1 (the feedback adds to the cut: 1 is the point to stay
  /// clear of); infinite if |L| < 1 everywhere.
  double phase_margin_rad = 0;
  double worst_rad_s = 0;  ///< where
};
/// `smoothing_s`: time constant of the chain's filter (three in a row). `servo_rad_s`: three equal poles of
/// the drives' position loop, whose zeros come from a PID with the velocity fed forward.
CorrectionMargins correction_margins(const DeflectionCorrection::Config& config, int axis, double smoothing_s,
                                     double servo_rad_s, double process);

/// The estimator's part of section [corrections.deflection]: `networks` (file, beside the config),
/// `stiffness_N_mm` (X, Y), `innovation_alarm` (times what training saw; kInnovationAlarm), `measure_every`,
/// and for each axis a table [corrections.deflection.X]: `gain_mm_s2_A`, `damping_1_s`, `mass_kg`,
/// `sigma_current_A`, `sigma_load_rate_N_s`, `sigma_position_mm`; and the correction's `gain`, `lag_s`,
/// `rate_mm_s`. ConfigError as ConfigTable, and as read_networks.
DeflectionCorrection::Config read_deflection(const ConfigTable& table, double period_s);

}  // namespace trn

#pragma once

#include <array>
#include <cstddef>

#include "core/realtime.h"

namespace trn {

/// A plain servo drive (P on the position, PI on the velocity, both many times a period) with motor, joint
/// and load: inertia, viscous and Coulomb friction, weight, and where the config has it a spring with a gap
/// between motor and load. Linear joints in N and mm, rotary ones in Nm and rad. It shares nothing with
/// JointModel.
class ServoMechanism {
 public:
  static constexpr std::size_t kCoggingWaves = 4;
  struct Config {
    double period_s = 0.001;
    double position_gain_1_s = 0;
    double velocity_gain = 0;    ///< N per mm/s, Nm per rad/s
    double integral_time_s = 0;  ///< of the velocity loop; 0: no integral part
    double force_max = 0;        ///< 0: without limit
    double inertia = 0;          ///< of motor and load together: N per mm/s^2, Nm per rad/s^2
    double viscous = 0, coulomb = 0;
    double gravity = 0;                      ///< N, Nm that holds the load
    double imbalance = 0, imbalance_at = 0;  ///< Nm that holds it where it is greatest; rad
    double cogging_pitch = 0;                ///< mm, rad after which the motor's cogging repeats; 0: none
    /// N, Nm of its first waves (so many in a pitch), and where each is greatest, mm or rad.
    std::array<double, kCoggingWaves> cogging{}, cogging_at{};
    double resonance_rad_s = 0;       ///< of motor against load; 0: they are rigid
    double load_share = 0.5;          ///< of the inertia, behind the spring
    double resonance_damping = 0.02;  ///< 1: critical
    double backlash = 0;              ///< mm, rad between motor and load, with a spring only
  };
  /// What the drive is told, besides the place.
  struct Reference {
    enum class Loop : unsigned char { kPosition, kVelocity, kTorque };
    Loop loop = Loop::kPosition;
    double velocity = 0;  ///< kPosition: offset; kVelocity: the target; mm or rad per s
    double force = 0;     ///< offset, or the target of kTorque; N or Nm
  };
  struct State {
    double x = 0, v = 0;  ///< of the motor, where the encoder sits
    double load_x = 0, load_v = 0;
    double integral = 0, force = 0;
  };

  explicit ServoMechanism(const Config& config);

  /// One period, in which the target goes evenly from `from` to `to`.
  void step(double from, double to, const Reference& reference, State& state) const TRN_RT;

 private:
  double wanted_force(double target, const Reference& reference, State& state) const TRN_RT;
  void move(double force, State& state) const TRN_RT;
  double weight_at(double x) const TRN_RT;
  double cogging_at(double x) const TRN_RT;
  double slowed(double v, double inertia) const TRN_RT;

  Config config_;
  int steps_;
  double dt_;
  double stiffness_ = 0, spring_damping_ = 0, motor_inertia_ = 0, load_inertia_ = 0;
};

}  // namespace trn

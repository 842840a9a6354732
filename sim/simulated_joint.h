#pragma once

#include <cstdint>
#include <optional>

#include "core/fault.h"
#include "core/ports.h"
#include "sim/hanging_load.h"
#include "sim/servo.h"
#include "sim/servo_mechanism.h"

namespace trn {

/// One simulated drive with its motor, switches and encoder. Inside, positions are true ones; outside, they
/// are what the encoder reads, which differs by a constant until the joint is homed.
class SimulatedJoint {
 public:
  struct Config {
    Servo::Config servo;
    double following_error_max = 0;         ///< mm or rad
    double acceleration_max = 0;            ///< per s^2, of good setpoints
    double quick_stop_deceleration = 0;     ///< per s^2
    double acceleration_homing = 0;         ///< per s^2
    double speed_search = 0;                ///< towards the home switch, per s
    double speed_index = 0;                 ///< from the switch to the index, per s
    double home = 0;                        ///< the home switch is closed below this position
    double index_distance = 0;              ///< the index lies this far above the edge of the switch
    double switch_min = 0, switch_max = 0;  ///< limit switches are closed beyond these positions
    double start = 0;                       ///< position at power-on
    double encoder_offset = 0;              ///< what an absolute encoder reads at the true place 0
    bool homed = false;                     ///< absolute encoder: knows its position at power-on
    std::uint32_t start_up_periods = 0;     ///< from bring-up to enabled
    std::uint32_t homing_periods_max = 0;
    /// In place of `servo`: a drive with a mechanism that weighs and rubs.
    std::optional<ServoMechanism::Config> mechanism = std::nullopt;
    HangingLoad::Config load;  ///< with one, the axis has a brake of its own; else it stands without power
  };
  using Reference = ServoMechanism::Reference;

  explicit SimulatedJoint(const Config& config);

  void enable() TRN_RT;
  void disable() TRN_RT;
  void reset() TRN_RT;
  void home() TRN_RT;
  void quick_stop(bool holds = false) TRN_RT;  ///< `holds`: at rest it keeps its torque
  /// Off and on again: an encoder that is not absolute counts from zero where it stands.
  void power_cycle() TRN_RT;
  /// Homing without a search: the position where it stands is `q`.
  void take_position(double q) TRN_RT;
  /// Homing by a drive's own head: `move_itself` in place of `step`, until `take_home`.
  void begin_homing() TRN_RT;
  void move_itself(double v_wanted, double acceleration) TRN_RT;
  void give_up_homing() TRN_RT;
  /// The encoder reads `reads` at the true place `place`.
  void take_home(double place, double reads) TRN_RT;
  /// One period with setpoint `q` (encoder coordinates; ignored unless enabled). `reference` is for a joint
  /// with a mechanism.
  void step(double q, const Reference& reference = {}) TRN_RT;
  /// N or Nm that the motor makes; 0 without a mechanism.
  double force() const TRN_RT { return mechanism_ ? moving_.force : 0; }
  bool has_mechanism() const TRN_RT { return mechanism_.has_value(); }

  double measured() const TRN_RT { return reported_; }
  double true_place() const TRN_RT { return plant_.x; }
  double absolute_offset() const TRN_RT { return config_.encoder_offset; }
  bool wants_to_move() const TRN_RT { return v_target_ != 0; }
  bool home_switch_dead() const TRN_RT { return home_switch_dead_; }
  DriveState state() const TRN_RT { return lost_ ? DriveState::kLost : state_; }
  Fault fault() const TRN_RT { return lost_ ? Fault::kDriveLost : fault_; }
  bool homed() const TRN_RT { return homed_; }
  bool on_limit_switch() const TRN_RT;
  /// Slows down by its own ramp; until it stands, it can neither be reset nor enabled.
  bool braking() const TRN_RT {
    return state_ == DriveState::kQuickStop || (state_ == DriveState::kFault && v_target_ != 0);
  }

  // Faults, by tests and scripts
  void fail(Fault fault) TRN_RT;                         ///< the drive faults by itself and brakes
  void set_lost(bool lost) TRN_RT { lost_ = lost; }      ///< it no longer answers, and brakes
  void set_stuck(bool stuck) TRN_RT { stuck_ = stuck; }  ///< the axis does not move
  /// The brake's output, of an axis with a load.
  void set_brake(bool released) TRN_RT { load_.set_brake(released); }
  void set_home_switch_dead(bool dead) TRN_RT { home_switch_dead_ = dead; }

 private:
  enum class Homing : std::uint8_t { kSearch, kBackOff, kIndex, kStop };

  void step_drive(double q, const Reference& reference) TRN_RT;
  void follow(double target, const Reference& reference = {}) TRN_RT;
  void stand_still() TRN_RT;
  void drive_itself(double v_wanted, double acceleration) TRN_RT;
  void step_enabled(double q, const Reference& reference) TRN_RT;
  void step_homing() TRN_RT;
  void step_homing_phase() TRN_RT;
  void step_brake() TRN_RT;
  bool has_torque() const TRN_RT;
  void hang(double x_before) TRN_RT;
  bool on_home_switch() const TRN_RT { return !home_switch_dead_ && plant_.x < config_.home; }

  Config config_;
  Servo servo_;
  std::optional<ServoMechanism> mechanism_;
  ServoMechanism::State moving_;
  Servo::State plant_;         ///< of the mechanism too: its encoder's place, its speed and target
  double v_target_ = 0;        ///< speed of the target when the drive moves by itself
  double encoder_offset_ = 0;  ///< encoder reading minus true position
  double reported_ = 0;
  std::uint32_t periods_ = 0;  ///< in the present state
  DriveState state_ = DriveState::kOff;
  Homing homing_ = Homing::kSearch;
  Fault fault_ = Fault::kOk;
  bool homed_ = false;
  bool lost_ = false;
  bool stuck_ = false;
  bool holds_ = false;  ///< behind a quick stop
  HangingLoad load_;
  bool home_switch_dead_ = false;
};

}  // namespace trn

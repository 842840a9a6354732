#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "hal/can/cia402.h"
#include "hal/can/cia402_axis.h"
#include "hal/can/node_link.h"
#include "hal/can/sdo.h"
#include "sim/canopen/emulated_homing.h"
#include "sim/canopen/emulated_units.h"
#include "sim/canopen/object_store.h"
#include "sim/simulated_joint.h"

namespace trn {

/// The drive inside an emulated node: the state machine and the modes of CiA 402-2 on a simulated joint. It
/// works on the objects 0x6040 to 0x60FF of the node's dictionary.
class EmulatedDrive {
 public:
  struct Config {
    SimulatedJoint::Config joint;
    double counts_per_unit = 1;  ///< per mm or rad
    double period_s = 0.001;
    unsigned touch_input_bit = 16;  ///< of 0x60FD
    EmulatedUnits units = {};
    DriveHabits habits = {};
    bool offset_is_zero = false;  ///< 0x607C is where the zero lies, seen from the home point
    /// None: as the joint's own config has them, one index above a switch at the lower end.
    std::optional<EmulatedHoming::Switches> switches = {};
    double torque_units = 0;  ///< thousandths of the rated torque for N or Nm
    StoSign sto = {};         ///< how it tells of Safe Torque Off
    int brake_bit = -1;       ///< of 0x60FE; -1: the brake is not wired to it
    bool brake_inverted = false;
    std::uint32_t inputs_on = 0;    ///< of 0x60FD, at power-on
    bool switches_swapped = false;  ///< each limit switch is wired to the other one's input
    int interpolation_steps = 1;    ///< periods of its own between two cyclic targets, without a 0x60C2
  };

  EmulatedDrive(const Config& config, ObjectStore& store);

  /// One period of the drive's own clock; writes statusword, position, mode display and inputs.
  void step();
  /// By itself: an emergency with this code; the drive brakes, then stands in Fault.
  void fail(std::uint16_t code);
  /// The connection to the master is gone: option code 0x6007.
  void lose_connection(std::uint16_t code);
  /// Off and on again; an encoder that is not absolute forgets where it is.
  void power_cycle();
  /// Out of Operation Enabled for no reason that it tells.
  void drop();
  /// Enabled, it stays where it is and tells so by bits 11 and 12; false: it follows again.
  void ignore_targets(bool ignores) { ignores_ = ignores; }
  /// Its own safety input takes its torque, and gives it back.
  void set_sto(bool active);
  /// Bits of 0x60FD that are on, beside limit switches and touch probe.
  void set_inputs(std::uint32_t on) { inputs_on_ = on; }
  std::uint32_t inputs() const { return inputs_on_; }
  /// Its bit of 0x60FD for the switch at this end of the plant, by the drive's own direction and as it is
  /// wired.
  std::uint32_t switch_bit(bool positive) const {
    return (config_.counts_per_unit > 0 ? positive : !positive) != config_.switches_swapped ? 2 : 1;
  }
  /// The next fault comes without an emergency message.
  void keep_quiet() { quiet_ = true; }
  DriveHabits& habits() { return config_.habits; }
  /// Code of a new emergency since the last call, or -1; 0 means that all errors are gone.
  int take_emergency();

  /// The input of the touch probe has changed when the encoder stood at `q`, mm or rad.
  void touch(bool contact, double q);

  /// Why its last homing found nothing; "" if it did.
  const char* why_not_homed() const { return homing_.why(); }

  SimulatedJoint& joint() { return joint_; }
  const SimulatedJoint& joint() const { return joint_; }
  Cia402State state() const { return state_; }
  bool powered() const {
    return state_ == Cia402State::kOperationEnabled || state_ == Cia402State::kQuickStopActive;
  }

 private:
  /// Objects that are touched every period, found once.
  struct Cell {
    Cell(ObjectStore& store, ObjectKey key) : bytes(store.bytes(key)) {}
    std::int64_t get() const;
    void set(std::int64_t value) const;
    std::vector<std::uint8_t>* bytes;
  };

  void obey_controlword(std::uint16_t control);
  void let_go(ObjectKey option);
  void follow_joint();
  double target();
  SimulatedJoint::Reference reference() const;
  double cyclic_target();
  double place_of(std::int64_t counts) const;
  int interpolation_steps() const;
  double profile_target();
  void begin_homing(std::uint16_t control);
  void move_joint();
  EmulatedHoming::Switches switches(int method) const;
  bool homes_by_itself() const { return homing_.running(); }
  void step_touch();
  void report();
  void step_brake_output();
  std::int64_t with_sign(std::int64_t bits) const;
  double counts_to_unit(double counts) const { return counts / config_.counts_per_unit; }
  void raise(std::uint16_t code);

  Config config_;
  ObjectStore& store_;
  SimulatedJoint joint_;
  Cell control_, status_, mode_, mode_display_, position_, velocity_, target_position_, target_velocity_,
      interpolation_, inputs_, touch_function_, touch_status_, touch_rise_, touch_fall_, velocity_offset_,
      torque_offset_, target_torque_, torque_;
  Cia402State state_ = Cia402State::kSwitchOnDisabled;
  std::uint16_t control_before_ = 0;
  std::int64_t mode_now_ = 0;
  double q_target_ = 0, q_before_ = 0, profile_goal_ = 0, profile_speed_ = 0;
  bool contact_ = false;
  double cyclic_goal_ = 0;
  int steps_left_ = 0;  ///< to it
  EmulatedHoming homing_;
  double homing_acceleration_ = 0;
  bool ignores_ = false, quiet_ = false, sto_ = false;
  std::uint32_t inputs_on_ = 0;
  int standing_ = 0;  ///< periods without motion
  bool attained_ = false, homing_error_ = false, acknowledge_ = false;
  int emergency_ = -1;
  std::uint16_t error_code_ = 0;
};

}  // namespace trn

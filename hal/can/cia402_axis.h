#pragma once

#include <cstdint>
#include <limits>

#include "core/fault.h"
#include "core/ports.h"
#include "hal/can/cia402.h"
#include "hal/can/point_move.h"
#include "hal/can/torque_loop.h"

namespace trn {

/// What drives do otherwise than CiA 402 has it, or leave out.
struct DriveHabits {
  bool mode_display = true;       ///< it has a 0x6061 that is true; else the mode it was told is believed
  bool follows_bit = true;        ///< bit 12 of the statusword tells that it follows the cyclic target
  bool homing_reached = true;     ///< after homing it sets bit 10 beside bit 12
  bool stands_to_switch = false;  ///< it changes its mode at a standstill only
};

/// One drive as the tick sees it: from its words to a DriveState and back (CiA 402-2, clauses 8 to 14). Pure;
/// a step a period. Nothing here waits: a drive that takes its time is kStarting until it is late.
class Cia402Axis {
 public:
  struct Config {
    Cia402Mode mode = Cia402Mode::kCyclicPosition;
    double counts_per_unit = 1;           ///< per mm or rad; negative: the motor turns the other way
    double offset = 0;                    ///< mm or rad, where the encoder counts zero
    double velocity_units = 1;            ///< of the drive, for one count/s
    bool absolute = false;                ///< the encoder knows its position at power-on; nothing to home
    double gain_1_s = 20;                 ///< position loop of the master in cyclic velocity mode
    double torque_units = 0;              ///< thousandths of the rated torque for N or Nm; 0: not known
    TorqueLoop::Config torque_loop = {};  ///< of the master in cyclic torque mode
    double following_error_max = 0;  ///< mm or rad, between setpoint and the feedback to it; 0: not watched
    double step_max = 0;             ///< mm or rad that a joint can move in a period; more is no measurement
    /// After homing the joint is moved there; not a number: it stays where homing ends.
    double home_final = std::numeric_limits<double>::quiet_NaN();
    double final_speed = 0, final_acceleration = 0;  ///< of that move, mm or rad per s, per s^2
    double period_s = 0.001;
    bool endless = false;  ///< the drive's 32 bits run over: positions are counted on beyond them
    bool braked = false;   ///< behind a quick stop somebody else holds the axis first: `end_stop`
    DriveHabits habits = {};
    std::uint32_t enable_periods_max = 2000, homing_periods_max = 120'000;
  };
  struct Input {
    std::uint16_t statusword = 0;
    std::int32_t position = 0;  ///< counts
    std::int8_t mode = 0;       ///< 0x6061
    bool fresh = false;         ///< from this period
    bool sto = false;           ///< its own safety input has taken its torque
  };
  struct Output {
    std::uint16_t controlword = 0;
    std::int32_t position = 0, velocity = 0;     ///< counts, the drive's units
    std::int8_t mode = 0;                        ///< 0x6060
    std::int32_t velocity_offset = 0;            ///< the drive's units
    std::int16_t torque = 0, torque_offset = 0;  ///< thousandths of the rated torque
  };

  explicit Cia402Axis(const Config& config)
      : config_(config), homed_(config.absolute), torque_loop_(config.torque_loop) {}

  /// While it is told to stop, it is enabled behind the stop.
  void enable() TRN_RT;
  void disable() TRN_RT;
  void quick_stop() TRN_RT;
  /// The stop is over: power off, and on again if `enable` has been called meanwhile.
  void end_stop() TRN_RT;
  void home() TRN_RT;
  /// Forgets the fault, and has the drive forget its own.
  void reset() TRN_RT;
  /// The drive has lost power or its mind: what it knew of its position is gone.
  void forget_position() TRN_RT {
    homed_ = config_.absolute;
    forgotten_ = true;
  }
  /// A fault found by whoever watches the bus.
  void fail(Fault fault) TRN_RT;

  /// Feed-forward that goes with the setpoint of the next step: mm or rad per s, N or Nm.
  void set_offsets(double velocity, double force) TRN_RT {
    velocity_offset_ = velocity;
    force_offset_ = force;
  }
  /// `q`, `qd`: setpoint of this period, obeyed when `follow`; else the drive holds where it stands.
  void step(const Input& input, double q, double qd, bool follow, Output& output) TRN_RT;

  DriveState state() const TRN_RT { return state_; }
  Fault fault() const TRN_RT { return fault_; }
  bool homed() const TRN_RT { return homed_; }
  double measured() const TRN_RT { return measured_; }
  /// Told to be enabled.
  bool wanted() const TRN_RT { return wish_ == Wish::kEnabled; }
  /// At one place for some periods, to a count.
  bool stands() const TRN_RT;
  /// Told to stop, and not yet without power.
  bool stopping() const TRN_RT { return wish_ == Wish::kStop; }
  /// Homing or on its way to the place behind it.
  bool homing() const TRN_RT { return homing_ != Homing::kNone; }
  double position_of(std::int32_t counts) const TRN_RT {
    return static_cast<double>(unwrapped(counts)) / config_.counts_per_unit + config_.offset;
  }
  bool measured_once() const TRN_RT { return measured_once_; }  ///< there has been feedback
  /// Setpoint to the count, as it goes out; saturates.
  std::int32_t counts(double q) const TRN_RT;

 private:
  enum class Wish : std::uint8_t { kOff, kEnabled, kStop };
  enum class Homing : std::uint8_t { kNone, kMode, kRun, kBack, kFinal };

  static std::int32_t saturated(double counts) TRN_RT;
  /// Of all counts that look like this one in 32 bits, the one nearest to where the drive was heard last.
  std::int64_t unwrapped(std::int32_t counts) const TRN_RT;
  void measure(const Input& input) TRN_RT;
  void step_fault(Cia402State drive, Output& output) TRN_RT;
  void step_wish(Cia402State drive, const Input& input, Output& output) TRN_RT;
  void step_stop(Cia402State drive) TRN_RT;
  void step_enabled(const Input& input, Output& output) TRN_RT;
  void step_homing(const Input& input, Output& output) TRN_RT;
  void end_homing() TRN_RT;
  void step_final() TRN_RT;
  void set_targets(const Input& input, double q, double qd, bool follow, Output& output) TRN_RT;
  void set_forces(double q, bool follow, Output& output) TRN_RT;
  std::int16_t thousandths(double force) const TRN_RT;
  void start_new_setpoint(const Input& input, Output& output) TRN_RT;
  void watch_following(double q, bool follow) TRN_RT;
  void watch_obedience(const Input& input, bool follow) TRN_RT;
  bool may_switch_mode() const TRN_RT;

  Config config_;
  Wish wish_ = Wish::kOff;
  bool again_ = false;  ///< told to be enabled while it stops
  Homing homing_ = Homing::kNone;
  DriveState state_ = DriveState::kOff;
  Fault fault_ = Fault::kOk;
  bool forgotten_ = true;          ///< the next position is taken as the drive tells it
  std::int64_t heard_counts_ = 0;  ///< counted on beyond 32 bits
  bool homed_ = false, was_enabled_ = false, reset_wish_ = false, reset_edge_ = false, measured_once_ = false;
  bool heard_once_ = false, agrees_ = false;  ///< the last two feedbacks are of one place
  bool acknowledged_ = true;
  bool followed_once_ = false;
  int implausible_ = 0;
  std::uint32_t enabled_periods_ = 0, ignored_periods_ = 0, standing_periods_ = 0;
  std::uint32_t periods_ = 0;
  double measured_ = 0, heard_ = 0;
  PointMove final_;  ///< of the setpoint behind homing
  std::int32_t measured_counts_ = 0;
  double velocity_offset_ = 0, force_offset_ = 0;
  TorqueLoop torque_loop_;
  double q_history_[2] = {0, 0};
  int history_ = 0;
  std::int32_t target_ = 0, sent_target_ = 0;
};

}  // namespace trn

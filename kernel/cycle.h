#pragma once

#include <optional>
#include <vector>

#include "core/axes.h"
#include "core/check.h"
#include "core/fault.h"
#include "core/frames.h"
#include "core/joint_model.h"
#include "core/machine.h"
#include "core/motion.h"
#include "core/ports.h"
#include "core/ring.h"
#include "kernel/feed_forward.h"
#include "kernel/hold_detour.h"
#include "kernel/interpolator.h"
#include "kernel/joint_jog.h"
#include "kernel/joint_ramp.h"
#include "kernel/motion_queue.h"
#include "kernel/overrides.h"
#include "kernel/path_rate.h"
#include "kernel/probe_move.h"
#include "kernel/rate_plans.h"
#include "kernel/retrace.h"
#include "kernel/rt_messages.h"
#include "kernel/safety_inputs.h"
#include "kernel/setpoint_chain.h"
#include "kernel/signal_wires.h"
#include "kernel/single_block.h"
#include "kernel/spindle_axis.h"
#include "kernel/tick_io.h"
#include "kernel/tick_port.h"

namespace trn {

/// Whether M0, M1 and a tool change wait for the operator's kResume, or pass because there is nobody.
enum class ProgramStops : std::uint8_t { kWait, kPass };

struct CycleConfig {
  double period_s = 0;
  Joints joints;
  Joints plan_joints;  ///< limits of the planned motion, without what the corrections keep for themselves
  ProgramStops stops = ProgramStops::kWait;
  bool optional_stop = true;      ///< M1 is one, until the operator switches it
  double spindle_timeout_s = 10;  ///< for its speed or place
  std::vector<SafetyInputs::Input> safety;
  std::vector<SignalWires::Wire> wires;
  Pose X_WB_idle = {};                 ///< in reports before a program's first motion
  std::size_t report_capacity = 4096;  ///< reports that wait to be read; more are lost, and counted
  std::optional<FeedForwardConfig> feed_forward = std::nullopt;
};

/// What the tick works with. All must outlive it.
struct CycleParts {
  const JointMap& map;
  MotionQueue& queue;
  Drives& drives;
  RatePlans& plans;
  SetpointChain* corrections = nullptr;  ///< null: the plan goes to the drives as it is
  MachineIo* io = nullptr;               ///< null: there are no devices beside the drives
  SpindleAxis* spindle_axis = nullptr;   ///< null: no joint is a spindle
};

/// The tick. Read `tick` first: everything that happens in a period stands there in order.
class Cycle final : public TickPort {
 public:
  Cycle(const CycleConfig& config, const CycleParts& parts);

  void tick() TRN_RT override;
  void latch(Fault fault) TRN_RT override { latch(fault, -1); }
  void tell_times(double wake_us, double tick_us) TRN_RT override {
    report_.wake_us = wake_us;
    report_.tick_us = tick_us;
  }
  bool post(const RtCommand& command) override { return commands_.try_push(command); }
  bool next_report(CycleReport& report) override { return reports_.try_pop(report); }

  /// The report of the last tick, for whoever runs in the tick's own thread.
  const CycleReport& last_report() const TRN_RT { return report_; }
  const PathRate& rate() const TRN_RT { return rate_; }
  const Interpolator& interpolator() const TRN_RT { return interpolator_; }

 private:
  static constexpr int kCommandsPerTick = 8;

  /// How a motion is brought to its end before its time.
  enum class Ending : std::uint8_t {
    kNone,
    kStop,    ///< slows down on its path, and is forgotten
    kRunOut,  ///< the same while the drives brake by themselves and do not obey
  };
  /// The event in front, where the program waits for the operator.
  struct ProgramWait {
    bool paused = false;          ///< kPaused because of it
    bool tool_confirmed = false;  ///< the tool change in front may pass
  };
  /// The place of a hold that the operator moves away from along the path.
  struct RetracedHold {
    bool paused = false;  ///< it was kPaused
    ProgramWait wait;
    QueueEvent waits_at;
    SourceLine source;
    bool resumes = false;  ///< as soon as the motion stands
  };
  /// Between two stretches with different corrections.
  struct CorrectionSwitch {
    bool pending = false;   ///< the next stretch begins with other corrections than the last one ended
    bool settling = false;  ///< the joints go over to those corrections
    bool off_path = false;  ///< from then on until the next stretch begins
  };
  struct Homing {
    unsigned mask = 0;      ///< joints that are asked to home
    bool answered = false;  ///< the drives have had the period that they need to begin
  };
  /// Joint setpoints, mm or rad.
  struct Setpoint {
    JointVec q, offset;     ///< of the plan; what the corrections add to it
    JointVec q_sent, last;  ///< their sum; the same in the last period
    JointVec stands;        ///< what drives that do not obey were told last: where they stand
  };
  /// What passed in the last period.
  struct Passed {
    double plan_s = 0;
    double tip_mm = 0;  ///< chord of the tip's path, while it is geared to the spindle
  };
  /// The plan runs, and the joints stay where they are.
  struct Lock {
    bool on = false;
    JointVec q_sent;  ///< where they stand
  };
  struct Latched {
    Fault fault = Fault::kOk;
    int joint = -1;
    CheckFailure check;  ///< the first that failed since the last reset
  };

  void take_commands() TRN_RT;
  void obey(const RtCommand& command) TRN_RT;
  void start(bool typed_in) TRN_RT;
  void resume() TRN_RT;
  void stop() TRN_RT;
  void quick_stop() TRN_RT;
  void jog(const RtCommand& command) TRN_RT;
  void begin_homing(int joint) TRN_RT;
  void retrace(double way_mm) TRN_RT;
  void end_retrace() TRN_RT;
  void set_lock(bool on) TRN_RT;

  void move() TRN_RT;
  void follow_path() TRN_RT;
  double target_rate() TRN_RT;
  double rate_by_queue(double wanted) TRN_RT;
  bool waits_for_plan(bool short_of_plan) TRN_RT;
  void drive(double plan_time_s) TRN_RT;
  bool map_setpoint() TRN_RT;
  bool meet_next_stretch() TRN_RT;
  void begin_settling(const JointVec& way) TRN_RT;
  void settle(double target) TRN_RT;
  bool stands_in_hold() const TRN_RT;
  void follow_detour() TRN_RT;
  void follow_retrace() TRN_RT;
  void follow_jog() TRN_RT;
  void follow_homing() TRN_RT;

  void pass_event() TRN_RT;
  TickIo::Outcome obey_event(const QueueEvent& event) TRN_RT;
  bool pauses_at(const QueueEvent& event) const TRN_RT;
  void end_of_event(const QueueEvent& event) TRN_RT;
  void switch_corrections(const QueueEvent& event) TRN_RT;
  bool arms_probe(const QueueEvent& event) TRN_RT;
  void end_probe() TRN_RT;
  void answer(const ProgramAnswer& answer) TRN_RT;

  void correct_setpoints() TRN_RT;
  void check_setpoints() TRN_RT;
  void keep_last_setpoint() TRN_RT;
  void stand_where_told() TRN_RT;
  void tell_drives() TRN_RT;
  void feed_forward() TRN_RT;
  void watch_drives() TRN_RT;
  void exchange_io() TRN_RT;
  bool may_move() const TRN_RT;
  void watch_safety() TRN_RT;
  void follow_wires() TRN_RT;
  std::uint32_t machine_signals() const TRN_RT;

  void latch(Fault fault, int joint) TRN_RT;
  void latch_failed_check() TRN_RT;
  void abandon_motion() TRN_RT;
  void run_out() TRN_RT;
  void come_to_rest() TRN_RT;
  bool ending() const TRN_RT { return ending_ != Ending::kNone; }

  MotionState shown_motion() const TRN_RT;
  void write_report() TRN_RT;
  void report_source(const SourceLine& source) TRN_RT;
  void report_place() TRN_RT;
  void report_io() TRN_RT;
  void report_corrections() TRN_RT;
  void report_tool_load() TRN_RT;

  const CycleConfig config_;
  const JointMap& map_;
  MotionQueue& queue_;
  Drives& drives_;
  SetpointChain* corrections_;
  SpindleAxis* spindle_axis_;
  Ring<RtCommand> commands_;
  Ring<CycleReport> reports_;

  MotionState motion_ = MotionState::kRest;
  Ending ending_ = Ending::kNone;
  Interpolator interpolator_;
  PathRate rate_;      ///< of the plan
  double stop_s_;      ///< plan time that a stop may take
  double unusable_s_;  ///< plan time at the end of what is seen: the rate planner's lead
  JointRamp ramp_;     ///< between stretches with other corrections
  JointJog jog_;
  Overrides overrides_;
  SingleBlock single_block_;
  bool optional_stop_;  ///< M1 stops
  ProbeMove probe_;
  TickIo io_;
  SafetyInputs safety_;
  SignalWires wires_;
  HoldDetour detour_;
  Retrace retrace_;
  RetracedHold retraced_;
  int still_periods_ = 0;  ///< that the plan's joints have not moved, up to kStillPeriods
  ProgramWait wait_;
  CorrectionSwitch switch_;
  Lock lock_;
  Homing homing_;
  Passed passed_;
  double dwell_left_s_ = 0;
  bool planner_late_ = false;  ///< slower than asked for, because of it
  double filling_s_ = 0;       ///< that the motion's start has waited for more of the plan, s

  FeedForward feed_forward_;
  Setpoint setpoint_;
  Setpoints setpoints_;  ///< as the drives are told them
  Feedback feedback_;
  bool obeyed_ = false;  ///< the drives follow: setpoint_.q agrees with where they stand
  Latched latched_;
  CycleReport report_;
  std::uint64_t period_ = 0;
};

}  // namespace trn

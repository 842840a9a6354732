#pragma once

#include "core/machine.h"
#include "core/ports.h"
#include "core/ring.h"
#include "core/touch_probe.h"
#include "kernel/interpolator.h"
#include "kernel/io_desk.h"
#include "kernel/jog.h"
#include "kernel/motion_port.h"
#include "kernel/path_rate.h"
#include "kernel/setpoint_chain.h"
#include "kernel/time_scale.h"

namespace trn {

struct CycleConfig {
  double period_s = 0;
  Joints joints;
  bool pause_at_program_stop = true;  ///< M0, M1 wait for kResume; false: they pass
  std::size_t report_capacity = 4096;
  Joints plan_joints = {};        ///< limits of the planned motion; empty: those of `joints`
  double spindle_timeout_s = 10;  ///< for its speed or place
  Pose X_WB_idle = {};            ///< in reports before a program's first motion
};

/// The tick. Read `tick` first: everything that happens in a period stands there in order.
class Cycle final : public TickPort {
 public:
  /// All references must outlive the cycle. `corrections` may be null: the plan goes to the drives as it is;
  /// `io` too: there are no devices beside the drives.
  Cycle(const CycleConfig& config, const JointMap& map, MotionQueue& queue, Drives& drives,
        SetpointChain* corrections = nullptr, MachineIo* io = nullptr);

  void tick() TRN_RT override;
  void latch(Fault fault) TRN_RT override { latch(fault, -1); }
  bool post(const RtCommand& command) override { return commands_.try_push(command); }
  bool next_report(CycleReport& report) override { return reports_.try_pop(report); }

  /// The report of the last tick, for whoever runs in the tick's own thread.
  const CycleReport& last_report() const TRN_RT { return report_; }
  const PathRate& path_rate() const TRN_RT { return path_rate_; }
  const Interpolator& interpolator() const TRN_RT { return interpolator_; }

 private:
  static constexpr int kCommandsPerTick = 8;

  void tell_drives() TRN_RT;
  void take_commands() TRN_RT;
  void obey(const RtCommand& command) TRN_RT;
  void resume() TRN_RT;
  void begin_jog(const RtCommand& command) TRN_RT;
  void begin_homing(int joint) TRN_RT;
  void move() TRN_RT;
  void follow_path() TRN_RT;
  double target_rate() TRN_RT;
  const MotionBlock* block_here(std::uint64_t& index) TRN_RT;
  bool pause_between_lines() TRN_RT;
  double way_to_line_end() TRN_RT;
  void release_line_passed() TRN_RT;
  void drive(double plan_time_s) TRN_RT;
  bool meet_next_stretch() TRN_RT;
  void begin_settling(const JointVec& way) TRN_RT;
  void settle(double target) TRN_RT;
  void switch_corrections(const QueueEvent& event) TRN_RT;
  void follow_jog(double target) TRN_RT;
  void follow_homing() TRN_RT;
  void pass_event() TRN_RT;
  IoDesk::Outcome obey_event(const QueueEvent& event) TRN_RT;
  bool pauses_at(const QueueEvent& event) const TRN_RT;
  void end_of_event(const QueueEvent& event) TRN_RT;
  void watch_probe() TRN_RT;
  bool arms_touch(const QueueEvent& event) TRN_RT;
  bool awaits_touch() TRN_RT;
  void end_probe() TRN_RT;
  void answer(const ProgramAnswer& answer) TRN_RT;
  void exchange_io() TRN_RT;
  void come_to_rest() TRN_RT;
  void correct_setpoints() TRN_RT;
  void check_setpoints() TRN_RT;
  void watch_drives() TRN_RT;
  void report_corrections() TRN_RT;
  void report_tool_load() TRN_RT;
  void write_report() TRN_RT;
  void latch(Fault fault, int joint) TRN_RT;
  void abandon_motion() TRN_RT;
  void run_out() TRN_RT;
  double rate_by_queue(double wanted) TRN_RT;
  double spindle_share() const TRN_RT { return overrides_.spindle && !io_.taps() ? spindle_override_ : 1.0; }

  CycleConfig config_;
  const JointMap& map_;
  MotionQueue& queue_;
  Drives& drives_;
  Ring<RtCommand> commands_;
  Ring<CycleReport> reports_;
  TimeScale time_scale_;  ///< of jogs
  PathRate path_rate_;    ///< of the plan
  Interpolator interpolator_;
  MotionState motion_ = MotionState::kRest;
  bool stopping_ = false;  ///< slows down to forget the motion
  bool runs_out_ = false;  ///< does so while the drives brake by themselves
  bool waiting_ = false;   ///< slower than asked for, because the planner is late
  double override_ = 1, rapid_override_ = 1, spindle_override_ = 1, adaptive_feed_ = 1;
  OverrideMode overrides_;  ///< in force
  bool single_block_ = false, step_begins_ = false;
  bool paused_by_program_ = false;                 ///< kPaused: an event waits in front
  bool tool_confirmed_ = false;                    ///< the tool change in front may pass
  std::uint32_t step_line_ = 0, step_number_ = 0;  ///< the line that was released; its last block passed
  double dwell_left_s_ = 0, jog_time_s_ = 0;
  SCurve jog_;
  JointVec jog_from_, jog_way_;  ///< joints = from + way * curve
  bool switched_ = false;        ///< the next stretch begins with other corrections than the last one ended
  bool settling_ = false;        ///< the joints go over to those corrections
  bool off_path_ = false;        ///< from then on until the next stretch begins
  unsigned homing_mask_ = 0, homing_seen_ = 0;
  IoDesk io_;
  double passed_s_ = 0;   ///< plan time of the last period
  double passed_mm_ = 0;  ///< tip path (chord) of the last one that moved geared to the spindle
  bool contact_ = false;  ///< slows down behind the place where the probe changed
  JointVec q_contact_;
  TouchDrives* touch_drives_;  ///< null: no touch probe on the drives
  bool touch_taken_ = false;   ///< the contact's latched positions
  int touch_wait_ = 0;         ///< periods that the drives' touch probe has had
  SetpointChain* corrections_;
  JointVec q_, offset_;       ///< of the plan; what the corrections add to it
  JointVec q_sent_, q_last_;  ///< their sum; the same in the last period
  Words y_last_ = Words::Zero();
  Setpoints setpoints_;
  Feedback feedback_;
  Fault fault_ = Fault::kOk;
  int fault_joint_ = -1;
  CycleReport report_;
  std::uint64_t period_ = 0;
  bool synchronised_ = false;  ///< q_ agrees with where the drives stand
};

}  // namespace trn

#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/client/command_table.h"
#include "app/daemon/access.h"
#include "app/daemon/alarm_list.h"
#include "app/daemon/command_effect.h"
#include "app/daemon/command_server.h"
#include "app/daemon/correction_warnings.h"
#include "app/daemon/held_mdi.h"
#include "app/daemon/jog_control.h"
#include "app/daemon/late_rate_plans.h"
#include "app/daemon/place_keeper.h"
#include "app/daemon/program_source.h"
#include "app/daemon/read_files.h"
#include "app/daemon/realtime.h"
#include "app/daemon/run_counters.h"
#include "app/daemon/spindle_speed.h"
#include "app/daemon/supervisor.h"
#include "app/daemon/switches.h"
#include "app/daemon/telemetry.h"
#include "app/daemon/worker.h"
#include "app/session/feature_recorder.h"
#include "app/session/machine_outputs.h"
#include "app/session/place_record.h"
#include "app/session/program_progress.h"
#include "app/session/program_step.h"
#include "app/session/session_log.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/machine.h"
#include "core/ports.h"
#include "hal/lcm_link.h"
#include "hal/local_socket.h"
#include "interp/gcode/measured_values.h"
#include "interp/gcode/program_config.h"
#include "kernel/joint_map.h"
#include "kernel/rt_messages.h"
#include "kernel/setpoint_chain.h"
#include "kernel/tick_port.h"

namespace trn {

/// The daemon's middle: commands and reports in, supervisor's actions out. Lives in one thread, never waits.
class MachineController {
 public:
  struct Parts {
    const Machine& machine;
    const LcmConfig& lcm;  ///< the names of the channels
    LocalServer& clients;
    const AccessRules& access;
    LcmPublisher& telemetry;  ///< hears what all clients hear
    Drives& drives;
    TickPort& tick;
    ProgramSource& programs;
    const LoopStatistics& statistics;
    SessionLog* log = nullptr;             ///< hears of every command
    const MachineJointMap* map = nullptr;  ///< has the corrections inside the plan; null: there are none
    const SetpointChain* chain = nullptr;
    const MachineIo* io = nullptr;              ///< null: none; only for the text of its fault
    const FeatureRecorder* features = nullptr;  ///< null: the machine knows nothing of the tool's bending
    const Kinematics* kinematics = nullptr;     ///< for jogs by axis word; null: joints only
    const Joints* plan_joints = nullptr;        ///< with the limits that jogs keep; null: the machine's own
    std::string version = {};                   ///< of the program, for clients
    std::string counters_file = {};             ///< RunCounters; "": in memory only
    PlaceKeeper* place = nullptr;               ///< records where the program is; null: nobody does
    LocalServer* safety = nullptr;  ///< hears clients that `clients` has no room for; null: nobody does
  };

  MachineController(const Parts& parts, std::vector<std::string> warnings);
  /// Gives up what programs are at; waits for a call of the drives that is under way.
  ~MachineController();
  MachineController(const MachineController&) = delete;
  MachineController& operator=(const MachineController&) = delete;

  /// Power up, as after a reset.
  void begin();
  /// The process shall end: stop on the path, then the drives, then `done`.
  void terminate();
  /// A report of the tick; all of them, in order.
  void report(const CycleReport& report);
  /// Something that the daemon needs beside the machine does not work: an alarm that stops nothing. `did`:
  /// what that means.
  void tell_trouble(const std::string& name, const std::string& text, const std::string& did);
  /// What is due by now: finished jobs, time limits, status and motion messages.
  void poll();

  /// The drives are off, or the time for that is over.
  bool done() const;
  /// "" if the machine came to rest and the drives were switched off; otherwise what was not done.
  std::string bad_ending() const;
  /// A call of the drives or of a program does not come back: this object cannot be destroyed.
  bool hangs() const { return drive_worker_.busy() || program_worker_.busy(); }
  const CycleReport& last_report() const { return report_; }
  MachineState state() const { return supervisor_.state(); }

 private:
  using Clock = std::chrono::steady_clock;
  using Answer = CommandServer::Answer;
  using Ticket = CommandServer::Ticket;

  static Answer accepted();
  static Answer refused(const std::string& why);
  static Answer refusal(MachineState before, const Decision& decision);
  Answer obey(const trunnion::command_t& command, const Ticket& ticket);
  void serve_without_room();
  Answer obey_legal(const trunnion::command_t& command, const Ticket& ticket);
  Answer obey_setting(const CommandRow& row, RtCommand::Kind kind, double value);
  Answer obey_switch(const trunnion::command_t& command, const Ticket& ticket);
  Answer switch_block_delete(bool on, const Ticket& ticket);
  std::string refuse_jog(const trunnion::command_t& command) const;
  Answer held_mdi(const std::string& text, const Ticket& ticket);
  HeldAt held_at() const;
  double tool_length_mm();
  double incoming_longer_mm();
  bool needs_new_way();
  std::string longer_text();
  Answer resume_anew(const Ticket& ticket);
  void lead_over_safe_height(const PlaceRecord& place, const JointVec& q, const Ticket& ticket);
  std::string why_not_on(Event event);
  Answer jog_along_held(const trunnion::command_t& command);
  void go_on_along();
  void hear_hold();
  void end_held_jog();
  Answer jog(const trunnion::command_t& command);
  Answer retrace(const trunnion::command_t& command);
  Answer jog_along(const trunnion::command_t& command, const Ticket& ticket);
  bool jogs_along() const;
  bool end_jog_plan();
  void let_go_for_the_dead();
  void end_silent_jogs();
  void forget_message();
  bool stands_for_tool() const;
  Answer confirm_tool(const Ticket& ticket);
  void keep_beginning(const std::string& path) const;
  void keep_end();
  void hear_wait(const CycleReport& report);
  void hear_progress(const CycleReport& report);
  void hear_probe(const CycleReport& report, const ProgramStep* step);
  void raise(Alarm alarm);
  void raise_fault(Fault fault, MachineState before);
  void fail_program(const std::string& error);
  Answer obey_note(const trunnion::command_t& command, const Ticket& ticket);
  Answer delete_tool(int number, const Ticket& ticket);
  Answer act_on_command(std::uint32_t actions, const trunnion::command_t& command, const Ticket& ticket);
  void machine_event(Event event);
  void act(std::uint32_t actions);
  void enter_state(MachineState before);
  /// Drives that are off and tell no fault have one all the same.
  CycleReport shown_report() const {
    CycleReport shown = report_;
    if (supervisor_.state() == MachineState::kFault && shown.fault == Fault::kOk) shown.fault = unnamed_;
    return shown;
  }

  /// Whoever sees the machine idle finds on disk what counts: up to then it shows the state before.
  MachineState shown_state() const {
    const MachineState state = supervisor_.state();
    return state == MachineState::kIdle ? takes_back_from_.value_or(state) : state;
  }

  void take_back_ahead(MachineState before);
  void post(RtCommand command);
  std::uint32_t unheard() const { return last_id_ - heard_id_; }
  void bring_up(bool reset_faults);
  void wait_until_heard(std::uint32_t id) const;
  void shut_down();
  Answer load(const std::string& path, const Ticket& ticket);
  Answer prepare(const Ticket& ticket, const std::string& path, std::uint32_t line, bool loaded);
  Answer load_from(std::string path, std::uint32_t line, const Ticket& ticket);
  Answer load_place(double before_mm, const Ticket& ticket);
  void note_place();
  PlaceRecord place_now(const ProgramStep& step);
  void note_way(const ProgramStep& step, bool fresh);
  void hear_measured();
  Answer start(const Ticket& ticket);
  std::string prepared_text() const;
  void hear_outputs(const CycleReport& report);
  void show_modes();
  void show_outputs();
  Answer mdi(const std::string& text, const Ticket& ticket, const std::function<void()>& then);
  /// For the record of the place.
  struct Noted {
    std::uint64_t block = 0;
    std::uint32_t step = 0;          ///< ProgramStep::source
    double gone_mm = 0;              ///< of the path, since that block was first seen
    double move_mm = 0;              ///< the same, of the step
    Words was_at = Words::Zero();    ///< path point of the last look
    Words stood_at = Words::Zero();  ///< path point of the last record
    bool on_path = false;            ///< `was_at` is known
    bool open = false;               ///< the record tells of a program that has not ended
    Clock::time_point next;
  };
  /// What a job of the program worker is for. Motion that is about to begin makes older reports meaningless.
  /// Behind kFirst another job answers.
  enum class Job { kLoad, kStart, kMdi, kResume, kSwitch, kFirst };
  void run_job(const Ticket& ticket, const std::function<void()>& prepare, const std::function<void()>& then,
               Job kind);
  std::function<void()> clear_then(const std::function<void()>& prepare);
  void finish_job(const Ticket& ticket, const std::string& error, const std::function<void()>& then,
                  Job kind);

  bool powerless(DriveState drives) const;
  void fault_event(Fault fault);
  void events_from(const CycleReport& report);
  template <typename Message>
  void publish(const std::string& channel, const Message& message);
  void publish_status();
  void publish_motion();
  void publish_tables();
  void publish_alarms();
  void add_progress(trunnion::status_t& status);
  void keep_counters();
  Conditions conditions() const;

  Parts parts_;
  Supervisor supervisor_;
  trunnion::status_t status_;  ///< with what no other part knows; the rest is filled in when it is sent
  CycleReport report_;
  LateRatePlans late_rate_plans_;
  CorrectionWarnings correction_warnings_;
  Fault last_fault_ = Fault::kOk;
  std::string bring_up_error_;
  Fault unnamed_ = Fault::kOk;  ///< behind the state `fault`, where the tick has latched none
  std::uint32_t last_id_ = 0;   ///< of the commands to the tick
  RtCommand last_posted_;
  bool told_full_ = false;                   ///< that the tick takes no commands
  std::atomic<std::uint32_t> heard_id_ = 0;  ///< of the last command that the tick has heard
  int jobs_ =
      0;  ///< bring-ups, starts and resumes, posted and not yet finished: reports mean nothing meanwhile
  int loads_ = 0;                              ///< the same, of programs that nothing waits for
  std::atomic<std::uint64_t> generation_ = 0;  ///< counts what makes a job's outcome void
  std::string program_path_, program_mark_;
  ReadFiles read_;  ///< that program's file, as it was loaded
  MachineOutputs outputs_, shown_outputs_;
  Noted noted_;                                          ///< what the record of the place was last told
  std::optional<PlaceRecord> placed_;                    ///< that record
  std::string ended_;                                    ///< program that came to its end since the last poll
  std::uint32_t from_line_ = 0;                          ///< of the loaded program; 0: from its start
  std::vector<BlockDeleteChange> block_delete_changes_;  ///< since it began
  bool under_way_ = false;      ///< a program or typed lines that were started, up to their end
  bool gave_up_ = false;        ///< these were given up: see take_back_ahead
  std::uint64_t in_block_ = 0;  ///< of these, where their motion was last (ProgramStep::block)
  std::optional<MachineState> takes_back_from_;  ///< is at it, and the machine's state before
  MeasuredValues measured_;                      ///< the same, with how the program found the tables
  JointVec began_;                               ///< where the machine stood then; empty: it has not begun
  std::string cause_;                    ///< command and client that the state changes for; "": the machine
  std::string job_message_;              ///< of the job that is being finished
  std::optional<JointVec> prepared_at_;  ///< where the loaded program, prepared to its start, begins
  bool shutting_down_ = false, drives_off_ = false;  ///< told to switch off; have done so
  bool closing_ = false, exit_wanted_ = false, came_to_rest_ = true;
  JogControl jogs_;
  bool jog_is_planned_ = false;                      ///< one along a direction, which has not begun
  bool jog_let_go_ = false;                          ///< that one, by whoever asked for it
  std::optional<CommandServer::Ticket> jog_holder_;  ///< of that one, if it ends when its client falls silent
  JointVec q_hold_;                                  ///< where the program was held, mm or rad
  double held_longer_mm_ = 0;  ///< the tool in force is longer by this than it was there
  std::int64_t status_count_ = 0;
  bool status_due_ = true, tables_due_ = false, alarms_due_ = false;
  std::optional<trunnion::tables_t> tables_;
  Clock::time_point next_status_, next_motion_, next_tables_, next_alarms_, closing_until_, power_off_by_,
      exit_by_;
  AlarmList alarms_;
  ProgramProgress progress_;
  RunCounters counters_;
  std::optional<Ticket> parts_ticket_;  ///< waits until they are on disk
  SpindleSpeed spindle_speed_;
  int late_periods_ = 0;  ///< of the planner, now
  CommandServer commands_;
  std::optional<CommandServer> safe_commands_;  ///< of clients for which there is no room
  Clock::time_point next_no_room_;              ///< may be told again
  Worker drive_worker_, program_worker_;        ///< a program that takes long keeps nobody from the drives
};

}  // namespace trn

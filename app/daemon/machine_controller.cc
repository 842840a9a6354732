#include "app/daemon/machine_controller.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>
#include <thread>
#include <tuple>
#include <utility>

#include "app/session/pipeline.h"
#include "core/motion.h"
#include "interp/move.h"

namespace trn {

namespace {

using trunnion::acknowledge_t;
using trunnion::command_t;

constexpr auto kClosingTime =
    std::chrono::seconds(10);  // both together: less than the 15 s that are promised
constexpr auto kSwitchOffTime = std::chrono::seconds(3);
constexpr auto kPowerOffTime = std::chrono::milliseconds(500);  // of the drives that are not in fault
constexpr auto kTickAnswers = std::chrono::seconds(5);
constexpr std::uint32_t kUnheardMax = 16;  // commands of clients ahead of a stop: the tick takes 8 a period

// A second one changes nothing while the first is still on its way.
bool says_again(const RtCommand& last, const RtCommand& next) {
  using Kind = RtCommand::Kind;
  const bool stops = next.kind == Kind::kQuickStop || next.kind == Kind::kEmergencyStop ||
                     (next.kind == Kind::kOverride && next.value == 0);
  return stops && last.kind == next.kind && last.value == next.value;
}

// People give overrides in percent.
std::string out_of_range(const CommandRow& row, double value) {
  if (row.verb == command_t::SINGLE_BLOCK)
    return fmt::format("{} {} is out of range: 0 to {:g} is legal", row.name, value, row.value_max);
  return fmt::format("{} {:g} % is out of range: 0 to {:g} % is legal", row.name, 100 * value,
                     100 * row.value_max);
}

bool drives_at_work(DriveState state) {
  return state == DriveState::kQuickStop || state == DriveState::kHoming;
}

}  // namespace

CommandServer::Answer MachineController::accepted() { return {acknowledge_t::ACCEPTED, ""}; }
CommandServer::Answer MachineController::refused(const std::string& why) {
  return {acknowledge_t::REFUSED, why};
}

CommandServer::Answer MachineController::refusal(MachineState before, const Decision& decision) {
  const bool latched = before == MachineState::kFault || before == MachineState::kEstop;
  return {latched ? acknowledge_t::FAULT : acknowledge_t::REFUSED, decision.refusal};
}

MachineController::MachineController(const Parts& parts, std::vector<std::string> warnings)
    : parts_(parts),
      status_(first_status(parts.machine, parts.version, std::move(warnings))),
      jogs_(parts.plan_joints ? *parts.plan_joints : parts.machine.joints, parts.kinematics, parts.map),
      next_status_(Clock::now()),
      next_motion_(Clock::now()),
      progress_(parts.machine.period_s),
      counters_(parts.counters_file),
      commands_(
          parts.clients, parts.access, parts.lcm,
          [this](const command_t& command, const Ticket& ticket) { return obey(command, ticket); },
          [this] { return status_count_ + 1; }, [this] { return unheard() < kUnheardMax; }) {
  const unsigned words = parts_.kinematics ? parts_.kinematics->word_mask() : 0;
  for (std::size_t i = 0; kWordLetters[i] != 0; ++i)
    if (words >> i & 1u) status_.axes += kWordLetters[i];
  // It needs our clock, and the tables.
  parts_.clients.on_connect([this](ConnectionId) { status_due_ = tables_due_ = alarms_due_ = true; });
  if (parts_.safety) serve_without_room();
}

// They may look on, and stop the machine.
void MachineController::serve_without_room() {
  static constexpr auto kTellAgain = std::chrono::minutes(1);
  parts_.safety->on_connect([this](ConnectionId connection) {
    status_due_ = tables_due_ = alarms_due_ = true;
    const Peer* peer = parts_.safety->peer(connection);
    if (!peer || Clock::now() < next_no_room_) return;
    next_no_room_ = Clock::now() + kTellAgain;
    spdlog::warn("no room for {}: one user may have {} connections, all together {}; it may stop the machine",
                 peer->text(), LocalServer::kConnectionsOfUserMax, LocalServer::kConnectionsMax);
  });
  safe_commands_.emplace(
      *parts_.safety, parts_.access, parts_.lcm,
      [this](const command_t& command, const Ticket& ticket) {
        if (!makes_safe(command))
          return refused(
              "the daemon has no room for another client, and hears only a stop, a hold and an "
              "emergency stop of this one; close another client");
        commands_.give_up_waiting();
        return obey(command, ticket);
      },
      [this] { return status_count_ + 1; });
}

MachineController::~MachineController() { parts_.programs.close(); }

void MachineController::begin() {
  machine_event(Event::kReset);
  show_modes();
}

void MachineController::show_modes() {
  program_worker_.post([this] {
    std::string error;
    try {
      parts_.programs.show();
    } catch (const std::exception& failure) {
      error = failure.what();
    }
    return Worker::Done([error] {
      if (!error.empty()) spdlog::warn("offsets, tools and codes cannot be shown: {}", error);
    });
  });
}

void MachineController::terminate() {
  parts_.programs.close();
  if (!closing_) closing_until_ = Clock::now() + kClosingTime;  // told twice is no reason to take longer
  closing_ = true;
  machine_event(Event::kTerminate);
}

Conditions MachineController::conditions() const {
  const unsigned all = (1u << parts_.machine.joints.size()) - 1u;
  return {!program_path_.empty(), (report_.homed_mask & all) == all, report_.stands_in_hold};
}

CommandServer::Answer MachineController::obey(const command_t& command, const Ticket& ticket) {
  const std::string bad = bad_values(command, static_cast<int>(parts_.machine.joints.size()));
  if (!bad.empty()) return refused(bad);
  cause_ = fmt::format("{}, by {}", find_command(command.verb)->name, ticket.from);
  const Answer answer = obey_legal(command, ticket);
  cause_.clear();
  return answer;
}

CommandServer::Answer MachineController::obey_legal(const command_t& command, const Ticket& ticket) {
  const CommandRow& row = *find_command(command.verb);
  const CommandEffect effect = effect_of(command.verb);
  if (effect.setting) return obey_setting(row, *effect.setting, command.value);
  if (row.act == CommandAct::kSwitch) return obey_switch(command, ticket);
  if (row.act == CommandAct::kNote) return obey_note(command, ticket);
  const MachineState before = supervisor_.state();
  if (command.verb == command_t::JOG && command.frame == command_t::PATH) return retrace(command);
  if (command.verb == command_t::JOG && command.frame != command_t::OWN) return jog_along(command, ticket);
  if (command.verb == command_t::JOG)
    if (const std::string why = refuse_jog(command); !why.empty()) return refused(why);
  if (command.verb == command_t::HOME && report_.machine_lock)
    return refused("the machine is locked; 'trunnion switch machine-lock off' lets the joints move");
  const bool idle = before == MachineState::kIdle;
  if (effect.event == Event::kStart && idle && loads_ > 0)
    return refused("the program is still being prepared; 'start' it when that is done");
  if (effect.event == Event::kStop && idle) from_line_ = 0;  // back to the program's beginning
  const bool anew = needs_new_way();
  if (effect.event == Event::kResume || effect.event == Event::kStart)
    if (const std::string why = why_not_on(*effect.event); !why.empty()) return refused(why);
  const Decision decision = supervisor_.handle(effect.event.value(), conditions());
  if (!decision.refusal.empty()) return refusal(before, decision);
  enter_state(before);
  if (anew && decision.actions & kDoResume) return resume_anew(ticket);
  return act_on_command(decision.actions, command, ticket);
}

// Overrides and single block, legal in every state.
CommandServer::Answer MachineController::obey_setting(const CommandRow& row, RtCommand::Kind kind,
                                                      double value) {
  using Kind = RtCommand::Kind;
  if (value < 0 || value > row.value_max) return refused(out_of_range(row, value));
  if (kind == Kind::kOverride) status_.override_wanted = value;
  if (kind == Kind::kRapidOverride) status_.rapid_override = value;
  if (kind == Kind::kSpindleOverride) status_.spindle_override = value;
  if (kind == Kind::kAdaptiveFeed) status_.adaptive_feed = value;
  spdlog::info("{} {:g}: {}", row.name, value, cause_);
  status_due_ = true;
  post({kind, value});
  return accepted();
}

CommandServer::Answer MachineController::obey_switch(const command_t& command, const Ticket& ticket) {
  const bool idle = supervisor_.state() == MachineState::kIdle && jobs_ + loads_ == 0;
  const SwitchOrder order = plan_switch(command, parts_.programs.switches(), idle, parts_.map, parts_.chain);
  if (!order.refusal.empty()) return refused(order.refusal);
  spdlog::info("{} {}: {}", order.name, command.value != 0 ? "on" : "off", cause_);
  if (order.changes_reading) return switch_block_delete(order.programs.block_delete, ticket);
  if (order.changes_plan) {
    parts_.programs.abandon();
    prepared_at_.reset();
  }
  parts_.programs.set_switches(order.programs);
  if (order.command) post(*order.command);
  status_due_ = true;
  return accepted();
}

// What is read already has been planned with it as it was.
CommandServer::Answer MachineController::switch_block_delete(bool on, const Ticket& ticket) {
  const MachineState state = supervisor_.state();
  if (state != MachineState::kRunning && state != MachineState::kHolding)
    return refused("block delete can be switched while the machine is idle, runs a program or holds one");
  const bool was = parts_.programs.switches().block_delete;
  const auto place = std::make_shared<ReadingPlace>();
  run_job(
      ticket, [this, on, place] { *place = parts_.programs.switch_block_delete(on); },
      [this, on, was, place] {
        const char* const done = on ? "skipped" : "run";
        job_message_ =
            place->line == 0
                ? fmt::format("lines with / are {} from the next start on: this program is read to its end",
                              done)
                : fmt::format("lines with / are {} behind line {} of {}; those before it were read already",
                              done, place->line, std::filesystem::path(place->file).filename().string());
        status_.message = job_message_;
        if (place->line == 0) return;
        progress_.lines_change();
        if (block_delete_changes_.empty()) block_delete_changes_.push_back({0, was});
        block_delete_changes_.push_back({place->block, on});
      },
      Job::kSwitch);
  return {acknowledge_t::WORKING, ""};
}

// What needs the command's own values; the rest is the same for commands and events.
CommandServer::Answer MachineController::act_on_command(std::uint32_t actions, const command_t& command,
                                                        const Ticket& ticket) {
  if (actions & kDoResume && stands_for_tool()) return confirm_tool(ticket);
  act(actions);
  if (actions & kDoLoad && command.value < 0) return load_place(command.speed, ticket);
  if (actions & kDoLoad)
    return command.value > 1
               ? load_from(command.text, static_cast<std::uint32_t>(std::min(command.value, 4e9)), ticket)
               : load(command.text, ticket);
  if (actions & kDoStart) return start(ticket);
  if (actions & kDoMdi && supervisor_.state() == MachineState::kHolding)
    return held_mdi(command.text, ticket);
  if (actions & kDoMdi) return mdi(command.text, ticket, [this] { status_.program = "mdi"; });
  if (actions & (kDoJog | kDoHome)) forget_message();
  if (actions & kDoJog) return jog(command);
  if (actions & kDoHome) post({RtCommand::Kind::kHome, 0, 0, command.joint});
  return accepted();
}

// What went wrong before is over when something new begins.
void MachineController::forget_message() {
  status_.message.clear();
  status_.program_failed = false;
}

bool MachineController::stands_for_tool() const {
  return report_.motion == MotionState::kPaused && report_.waits_at.kind == QueueEvent::Kind::kToolChange;
}

// The tool in the spindle is on disk before the program may go on with it.
CommandServer::Answer MachineController::confirm_tool(const Ticket& ticket) {
  const int tool = report_.waits_at.argument;
  run_job(
      ticket, [this, tool] { parts_.programs.confirm_tool(tool); },
      [this, tool] {
        spdlog::info("{} is in the spindle", parts_.programs.tool_name(tool));
        post({RtCommand::Kind::kResume});
      },
      Job::kResume);
  return {acknowledge_t::WORKING, ""};
}

void MachineController::machine_event(Event event) {
  const MachineState before = supervisor_.state();
  const Decision decision = supervisor_.handle(event, conditions());
  enter_state(before);
  act(decision.actions);
}

void MachineController::enter_state(MachineState before) {
  const MachineState now = supervisor_.state();
  if (now == before) return;
  spdlog::info("{} -> {}{}{}", to_string(before), to_string(now), cause_.empty() ? "" : ": ", cause_);
  const bool latched = now == MachineState::kFault || now == MachineState::kEstop;
  if (!latched) alarms_.over();
  if (now == MachineState::kIdle) take_back_ahead(before);
  if (now == MachineState::kIdle)
    status_.program = program_path_;  // behind a typed line or a jog: what 'start' begins
  if (now == MachineState::kFault)
    unnamed_ = before == MachineState::kStarting ? Fault::kDriveNotReady : Fault::kDriveDropped;
  if (latched)
    raise_fault(now == MachineState::kEstop ? Fault::kEmergencyStop : shown_report().fault, before);
  status_due_ = true;
}

void MachineController::act(std::uint32_t actions) {
  using Kind = RtCommand::Kind;
  if (actions & (kDoQuickStop | kDoDropProgram)) {
    ++generation_;
    jog_holder_.reset();  // what runs next is not that client's
  }
  constexpr std::uint32_t kEndsMotion = kDoStopOnPath | kDoDropProgram;
  outputs_.broken_off |= (actions & kDoQuickStop) || (actions & kEndsMotion) == kEndsMotion;
  if (actions != kDoNothing && !(actions & (kDoJog | kDoMdi))) jogs_.forget_way();
  const bool estop = supervisor_.state() == MachineState::kEstop;
  if (actions & kDoQuickStop) post({estop ? Kind::kEmergencyStop : Kind::kQuickStop});
  if (actions & kDoStopOnPath) post({Kind::kStop});
  if (actions & kDoHold) post({Kind::kHold});
  if (actions & kDoResume) post({Kind::kResume});
  if (actions & kDoDropProgram) {
    gave_up_ |= under_way_;
    parts_.programs.abandon();
    prepared_at_.reset();
  }
  if (actions & kDoBringUp) bring_up((actions & kDoResetFaults) != 0);
  if (actions & kDoShutDown) shut_down();
  if (actions & kDoExit && !exit_wanted_) {
    take_back_ahead(supervisor_.state());
    exit_wanted_ = true;
    exit_by_ = Clock::now() + kSwitchOffTime;
  }
}

// Lines of a program are read ahead of its motion. Those that were not driven have set nothing.
void MachineController::take_back_ahead(MachineState before) {
  if (!std::exchange(gave_up_, false)) return;
  under_way_ = false;
  takes_back_from_ = before;
  program_worker_.post([this, block = in_block_] {
    std::string error;
    try {
      parts_.programs.gave_up_at(block);
    } catch (const std::exception& failure) {
      error = failure.what();
    }
    return Worker::Done([this, error] {
      takes_back_from_.reset();
      status_due_ = true;
      if (error.empty()) return;
      status_.message = "what was read ahead of the motion is not taken back: " + error;
      spdlog::error("{}", status_.message);
    });
  });
}

// The tick has room for many more than clients may fill, so it is full only when its thread stands.
void MachineController::post(RtCommand command) {
  if (unheard() > 0 && says_again(last_posted_, command)) return;
  command.id = ++last_id_;
  last_posted_ = command;
  if (parts_.log) parts_.log->posted(command);
  const bool taken = parts_.tick.post(command);
  if (!taken && !told_full_) spdlog::critical("the tick has taken no command for long; its thread stands");
  told_full_ = !taken;
}

// A stop that the tick has not yet passed on to the drives would come behind this, and take them from under
// setpoints that stand already.
void MachineController::bring_up(bool reset_faults) {
  const auto prepare = [this, reset_faults, id = last_id_] {
    wait_until_heard(id);
    if (reset_faults) parts_.drives.reset_faults();
    parts_.drives.bring_up();
    for (const std::string& warning : parts_.drives.warnings()) spdlog::warn("{}", warning);
  };
  ++jobs_;
  drive_worker_.post([this, prepare, generation = generation_.load()] {
    std::string error;
    try {
      prepare();
    } catch (const std::exception& failure) {
      error = failure.what();
    }
    return Worker::Done([this, error, generation] {
      --jobs_;
      if (!error.empty()) spdlog::error("the drives do not come up: {}", error);
      const MachineState now = supervisor_.state();
      if (generation != generation_) {
        // Stopped meanwhile. What came up all the same goes down again; behind another reset it may come up.
        last_posted_ = {};
        const bool estop = now == MachineState::kEstop;
        if (now != MachineState::kStarting)
          post({estop ? RtCommand::Kind::kEmergencyStop : RtCommand::Kind::kQuickStop});
        return;
      }
      status_.message = bring_up_error_ = error;
      if (!error.empty()) return machine_event(Event::kStartFailed);
      if (now == MachineState::kStarting) post({RtCommand::Kind::kResetFault});
    });
  });
}

void MachineController::shut_down() {
  if (shutting_down_) return;
  shutting_down_ = true;
  power_off_by_ = Clock::now() + kPowerOffTime;
  drive_worker_.post([this] {
    parts_.drives.shut_down();
    return Worker::Done([this] {
      drives_off_ = true;
      spdlog::info("drives are off");
    });
  });
}

bool MachineController::done() const {
  return exit_wanted_ && (Clock::now() > exit_by_ || ((drives_off_ || !shutting_down_) && !takes_back_from_));
}

std::string MachineController::bad_ending() const {
  if (shutting_down_ && !drives_off_)
    return "the drives did not answer when they were to be switched off; they still may have power";
  return came_to_rest_ ? "" : "the machine did not come to rest in time; the drives were made to stop";
}

CommandServer::Answer MachineController::mdi(const std::string& text, const Ticket& ticket,
                                             const std::function<void()>& then) {
  parts_.programs.set_outputs(outputs_);
  const auto prepare = [this, text, q = report_.q_plan] { parts_.programs.load_mdi(text, q); };
  run_job(ticket, clear_then(prepare), then, Job::kMdi);
  return {acknowledge_t::WORKING, ""};
}

// A new program must not meet what is left of the last one: the tick forgets that first.
std::function<void()> MachineController::clear_then(const std::function<void()>& prepare) {
  parts_.programs.abandon();
  prepared_at_.reset();
  post({RtCommand::Kind::kStop});
  return [this, prepare, id = last_id_] {
    wait_until_heard(id);
    prepare();
  };
}

// In a worker's thread: until the tick has taken the command.
void MachineController::wait_until_heard(std::uint32_t id) const {
  const auto end = Clock::now() + kTickAnswers;
  while (static_cast<std::int32_t>(heard_id_.load() - id) < 0) {
    if (Clock::now() > end) throw std::runtime_error("the tick does not answer; its thread has stopped");
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

void MachineController::run_job(const Ticket& ticket, const std::function<void()>& prepare,
                                const std::function<void()>& then, Job kind) {
  int& open_jobs = kind == Job::kLoad || kind == Job::kSwitch ? loads_ : jobs_;
  ++open_jobs;
  const std::tuple<std::string, bool> before{status_.message, status_.program_failed};
  if (kind != Job::kSwitch) forget_message();
  program_worker_.post([=, this, &open_jobs, generation = generation_.load(), cause = cause_] {
    std::string error;
    try {
      const bool due = generation == generation_;
      if (due) prepare();
      const bool moves = kind == Job::kStart || kind == Job::kMdi;
      if (due && moves && generation != generation_) parts_.programs.gave_up_at(0);
    } catch (const std::exception& failure) {
      error = failure.what();
    }
    return Worker::Done([=, this, &open_jobs] {
      --open_jobs;
      const bool let_go = kind == Job::kMdi && end_jog_plan();
      if (generation != generation_)
        return commands_.finish(ticket, let_go ? accepted()
                                               : CommandServer::Answer{acknowledge_t::FAULT,
                                                                       "given up: the machine was stopped"});
      cause_ = cause;
      finish_job(ticket, error, then, kind);
      if (!error.empty() && kind == Job::kMdi)  // who typed it is told; for all others nothing has happened
        std::tie(status_.message, status_.program_failed) = before;
      cause_.clear();
    });
  });
}

void MachineController::finish_job(const Ticket& ticket, const std::string& error,
                                   const std::function<void()>& then, Job kind) {
  const bool starts_motion = kind == Job::kStart || kind == Job::kMdi;
  status_due_ = true;
  if (error.empty()) {
    then();
    if (kind == Job::kFirst) return;
    if (starts_motion) {
      prepared_at_.reset();
      if (kind == Job::kStart) {
        from_line_ = 0;
        shown_outputs_ = {0, 0, true, false};  // a program begins with the config's modes
      }
      outputs_.broken_off = gave_up_ = false;
      under_way_ = true;
      in_block_ = 0;
      post({RtCommand::Kind::kStart, kind == Job::kMdi ? 1.0 : 0.0});
    }
    return commands_.finish(ticket, {acknowledge_t::ACCEPTED, std::exchange(job_message_, "")});
  }
  // Nothing has run, so it is no alarm of the machine.
  spdlog::warn("refused, {}: {}", cause_, error);
  if (kind != Job::kSwitch) status_.message = error;
  if (starts_motion) machine_event(Event::kMotionDone);
  commands_.finish(ticket, {acknowledge_t::BAD_PROGRAM, error});
}

void MachineController::fault_event(Fault fault) {
  // The echo of what was commanded here. It may come when a reset has followed already.
  if (fault == Fault::kEmergencyStop) return;
  const Reaction reaction = fault_info(fault).reaction;
  // Pressed is the same as commanded.
  if (fault == Fault::kEmergencyInput) return machine_event(Event::kEstop);
  if (reaction == Reaction::kPathStop) machine_event(Event::kPathFault);
  if (reaction == Reaction::kQuickStop) machine_event(Event::kQuickFault);
}

void MachineController::report(const CycleReport& report) {
  hear_wait(report);
  hear_progress(report);
  report_ = report;
  hear_outputs(report);
  hear_hold();
  heard_id_ = report.last_command_id;
  if (parts_.chain && correction_warnings_.hear(*parts_.chain, report)) status_due_ = true;
  late_rate_plans_.hear(report.late_rate_plans, Clock::now());
  if (report.fault != last_fault_) {
    last_fault_ = report.fault;
    status_due_ = true;
    const MachineState before = supervisor_.state();
    fault_event(report.fault);
    // A worse one, or one of no reaction, leads to no other state. The stop itself was told when it came.
    if (supervisor_.state() == before && report.fault != Fault::kEmergencyStop)
      raise_fault(report.fault, before);
  }
  // before the tick has heard the last command, what it reports is of the past
  if (jobs_ == 0 && report.last_command_id == last_id_) events_from(report);
}

// A drive in fault, or one that is gone, will never report that it is off.
bool MachineController::powerless(DriveState drives) const {
  const bool silent = drives == DriveState::kFault || drives == DriveState::kLost;
  return drives == DriveState::kOff || (silent && shutting_down_ && Clock::now() > power_off_by_);
}

void MachineController::events_from(const CycleReport& report) {
  // one that comes back in the very period of the reset has no edge
  if (supervisor_.state() == MachineState::kStarting) fault_event(report.fault);
  if (report.drives == DriveState::kEnabled) machine_event(Event::kDrivesReady);
  if (powerless(report.drives)) machine_event(Event::kDrivesOff);
  if (report.motion == MotionState::kPaused) machine_event(Event::kPaused);
  if (report.motion == MotionState::kRest && !drives_at_work(report.drives))
    machine_event(Event::kMotionDone);
}

void MachineController::poll() {
  // What has ended is kept before a command may begin the next program. While a job prepares a program, its
  // failure is the job's answer.
  const std::string failure = jobs_ + loads_ == 0 ? parts_.programs.take_failure() : "";
  if (!failure.empty()) {
    spdlog::error("{}", failure);
    fail_program(failure);
    status_.program_failed = true;
    if (parts_.programs.lost()) machine_event(Event::kStop);
  }
  keep_end();
  drive_worker_.collect();
  let_go_for_the_dead();
  program_worker_.collect();
  commands_.poll();
  end_silent_jogs();
  go_on_along();
  show_outputs();
  for (const ProgramMessage& said : parts_.programs.take_messages()) {
    spdlog::info("the program says in line {}: {}", said.line, said.text);
    status_.message = said.text;
    status_due_ = true;
  }
  const auto now = Clock::now();
  if (supervisor_.state() == MachineState::kClosing && now > closing_until_) {
    spdlog::error("the machine does not come to rest; taking the power from the drives");
    came_to_rest_ = false;
    machine_event(Event::kTimeout);
  }
  if (status_due_ || now >= next_status_) publish_status();
  if (now >= next_motion_) publish_motion();
  hear_measured();
  note_place();
  publish_tables();
  publish_alarms();
}

}  // namespace trn

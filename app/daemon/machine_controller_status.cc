#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <string>
#include <utility>

#include "app/daemon/alarm_list.h"
#include "app/daemon/command_server.h"
#include "app/daemon/machine_controller.h"
#include "app/daemon/program_source.h"
#include "app/daemon/supervisor.h"
#include "app/daemon/worker.h"
#include "app/session/machine_outputs.h"
#include "app/session/pipeline.h"
#include "app/session/plan_time.h"
#include "app/session/program_step.h"
#include "app/session/program_time.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/motion.h"
#include "core/ports.h"
#include "core/utf8.h"
#include "interp/gcode/axis_words.h"
#include "kernel/rt_messages.h"

// What the controller of the machine tells: what it waits for, what went wrong, how far it has come.
namespace trn {

namespace {

using trunnion::acknowledge_t;

constexpr auto kStatusPeriod = std::chrono::milliseconds(100);
constexpr auto kTablesPeriod = std::chrono::seconds(2);  // over LCM nobody is seen to begin to listen
constexpr auto kMotionPeriod = std::chrono::milliseconds(20);
constexpr auto kAlarmsPeriod = std::chrono::seconds(1);
constexpr double kLateShown_s = 0.3;  // a planner that is late for less is nobody's business

}  // namespace

void MachineController::hear_wait(const CycleReport& report) {
  const double late_s = parts_.machine.period_s * late_periods_;
  late_periods_ = report.planner_late ? late_periods_ + 1 : 0;
  const QueueEvent &was = report_.waits_at, &is = report.waits_at;
  const bool same = report.motion == report_.motion && report.detour == report_.detour &&
                    is.kind == was.kind && is.argument == was.argument && report.step == report_.step;
  const bool late = report.rate_plan_late || report_.rate_plan_late || report.planner_late || late_s > 0;
  if (same && !late) return;
  const ProgramStep* step = parts_.programs.step(present_step(report));
  std::string text = waits_text(report, step, [this](int tool) { return parts_.programs.tool_name(tool); });
  if (text.empty() && report.planner_late && late_s > kLateShown_s)
    text = "the planner: the program's lines are driven faster than they are read and planned";
  if (text == status_.waits_for) return;
  if (!text.empty()) spdlog::info("line {}: waits for {}", report.line, text);
  status_.waits_for = text;
  status_due_ = true;
}

// As long as 'start' does not begin the loaded program at its first line.
std::string MachineController::prepared_text() const {
  if (from_line_ <= 1 || program_path_.empty()) return "";
  const bool prepared = prepared_at_ && *prepared_at_ == report_.q_plan;
  if (prepared)
    return fmt::format("prepared from line {}: 'start' begins there; 'stop' gives that up", from_line_);
  return fmt::format(
      "the way to line {} was shown before the machine moved or was given something else to do; show it "
      "again "
      "('trunnion start --from {}'), or 'load' the program to begin with its first line",
      from_line_, from_line_);
}

// What is told to the spindle is 0, too, while its override is.
void MachineController::hear_outputs(const CycleReport& report) {
  outputs_.coolant = report.coolant;
  const double share = status_.spindle_override;
  const bool heard = report.last_command_id == last_id_ && share > 0;
  outputs_.rpm_known = report.spindle_rpm != 0 || heard || outputs_.broken_off;
  outputs_.rpm = heard ? report.spindle_rpm / share : report.spindle_rpm;
}

// What was switched off behind the back of the lines that were typed shows in the codes in force.
void MachineController::show_outputs() {
  const MachineState state = supervisor_.state();
  const bool rests =
      state == MachineState::kIdle || state == MachineState::kFault || state == MachineState::kEstop;
  const auto turn = [](const MachineOutputs& outputs) {
    return outputs.rpm_known ? (outputs.rpm > 0) - (outputs.rpm < 0) : 2;
  };
  const bool same = turn(outputs_) == turn(shown_outputs_) && outputs_.coolant == shown_outputs_.coolant;
  if (!rests || same || jobs_ + loads_ > 0 || report_.motion != MotionState::kRest ||
      report_.last_command_id != last_id_)
    return;
  shown_outputs_ = outputs_;
  parts_.programs.set_outputs(outputs_);
  show_modes();
}

// Where a thing that went wrong belongs.
void MachineController::raise(Alarm alarm) {
  const MachineState state = supervisor_.state();
  const bool program = alarm.name == kProgramAlarm;
  const bool typed = program && alarm.text.starts_with("mdi:");  // in no program
  const bool at_work = !typed && (follows_program(report_) || state == MachineState::kRunning);
  if (at_work || (program && !typed)) alarm.program = status_.program;
  if (at_work && alarm.line == 0) alarm.line = static_cast<std::int32_t>(report_.line);
  alarm.cause = cause_;
  alarms_.raise(std::move(alarm));
  status_due_ = true;
}

void MachineController::tell_trouble(const std::string& name, const std::string& text,
                                     const std::string& did) {
  spdlog::error("{}", text);
  Alarm alarm;
  alarm.name = name;
  alarm.text = text;
  alarm.did = did;
  raise(std::move(alarm));
}

void MachineController::raise_fault(Fault fault, MachineState before) {
  if (fault == Fault::kOk) return;
  std::string joint, detail;
  if (fault != Fault::kEmergencyStop) {
    detail = explain(report_.failed_check);
    if (detail.empty()) detail = parts_.drives.explain_fault(report_.fault_joint);
    if (detail.empty() && parts_.io) detail = parts_.io->explain_fault();
    if (detail.empty() && before == MachineState::kStarting) detail = bring_up_error_;
    const FaultInfo& info = fault_info(fault);
    spdlog::error("fault {}: {}; {}", info.name, info.meaning, info.remedy);
    const auto k = static_cast<std::size_t>(report_.fault_joint);
    if (report_.fault_joint >= 0 && k < parts_.machine.joints.size()) joint = parts_.machine.joints[k].name;
  }
  if (!detail.empty()) {
    spdlog::error("{}", detail);
    status_.message = detail;
  }
  Alarm alarm = fault_alarm(fault, joint, detail, before);
  // By now the program is given up, and its motion may have ended.
  if (before == MachineState::kRunning || before == MachineState::kHolding ||
      before == MachineState::kStopping) {
    alarm.program = status_.program;
    alarm.line = static_cast<std::int32_t>(report_.line);
  }
  raise(std::move(alarm));
}

void MachineController::fail_program(const std::string& error) {
  status_.message = error;
  const bool runs = follows_program(report_) && supervisor_.state() == MachineState::kRunning;
  Alarm alarm;
  alarm.name = kProgramAlarm;
  alarm.text = error;
  alarm.did = runs ? "the program ends before this line" : "nothing moved";
  raise(std::move(alarm));
}

// Of what the tick counts and does.
void MachineController::hear_progress(const CycleReport& report) {
  const bool at_work = follows_program(report) && report.motion != MotionState::kPaused;
  if (report.starvations != report_.starvations)
    raise(fault_alarm(Fault::kStarved, "", "", supervisor_.state()));
  if (!report.planner_late && report_.planner_late) alarms_.over(fault_info(Fault::kStarved).name);
  if (follows_program(report) && !follows_program(report_)) counters_.program_begins();
  if (at_work && report.motion == MotionState::kMoving) counters_.program_ran(parts_.machine.period_s);
  const bool ended = report.event.kind == QueueEvent::Kind::kProgramEnd && report.fault == Fault::kOk;
  if (ended && status_.program == program_path_) ended_ = program_path_;
  const ProgramStep* step = parts_.programs.step(present_step(report));
  if (step && present_step(report) > 0) in_block_ = step->block;
  if (report.event.kind == QueueEvent::Kind::kProgramEnd) under_way_ = false;
  const OverrideShares shares{status_.override_wanted, status_.rapid_override, status_.adaptive_feed,
                              status_.spindle_override};
  const bool own = present_step(report) > 0 && status_.program == program_path_;
  progress_.report(report, own ? step : nullptr, shares);
  spindle_speed_.hear(report.spindle_turns, parts_.machine.period_s);
  if (report.answered && report.answer.probe) hear_probe(report, step);
}

void MachineController::hear_probe(const CycleReport& report, const ProgramStep* step) {
  Words words = report.answer.y_stand;
  if (!step || !parts_.map ||
      words_in(*parts_.map, report.answer.q_contact, step->context, words) != KinStatus::kOk)
    return;
  status_.probe_known = true;
  status_.probe_contact = report.answer.value > 0;
  const Words si = in_radians(step->frame.mm_of(words));
  std::copy(si.begin(), si.end(), status_.probe);
}

void MachineController::add_progress(trunnion::status_t& status) {
  ProgramTime total;
  if (parts_.programs.take_program_time(total)) progress_.set_total(total);
  const bool shown = status.program == program_path_ && !program_path_.empty();
  status.time_total_s = shown ? progress_.total_s() : 0;
  status.time_done_s = shown ? progress_.done_s() : 0;
  status.time_left_s = shown ? progress_.left_s() : -1;
  status.time_about = shown && progress_.about();
  keep_counters();
  status.parts = counters_.parts();
  status.program_run_s = counters_.program_s();
  status.run_s = counters_.run_s();
  status.spindle_real_known = spindle_speed_.known();
  status.spindle_real_rpm = spindle_speed_.rpm();
}

void MachineController::keep_counters() {
  counters_.poll();
  const std::string trouble = counters_.take_trouble();
  if (!trouble.empty()) tell_trouble("counters", trouble, "parts and run time are not kept");
  if (!parts_ticket_ || (trouble.empty() && !counters_.parts_are_kept())) return;
  const Ticket ticket = *std::exchange(parts_ticket_, std::nullopt);
  if (trouble.empty()) return commands_.finish(ticket, accepted());
  commands_.finish(ticket, refused(fmt::format("{}; the parts are not kept", trouble)));
}

// What changes no motion, and is legal in every state.
MachineController::Answer MachineController::obey_note(const trunnion::command_t& command,
                                                       const Ticket& ticket) {
  status_due_ = true;
  if (command.verb == trunnion::command_t::DELETE_TOOL)
    return delete_tool(static_cast<int>(command.value), ticket);
  if (command.verb == trunnion::command_t::PARTS) {
    spdlog::info("parts {}: {}", command.value, cause_);
    counters_.set_parts(static_cast<std::int64_t>(command.value));
    if (parts_ticket_) commands_.finish(*parts_ticket_, refused("another number of parts was given"));
    parts_ticket_ = ticket;
    return {acknowledge_t::WORKING, ""};
  }
  const auto number = static_cast<std::int64_t>(command.value);
  if (!alarms_.acknowledge(number))
    return {acknowledge_t::REFUSED,
            fmt::format("there is no alarm {}; 'trunnion status' lists them", number)};
  spdlog::info("alarms acknowledged: {}", cause_);
  return {acknowledge_t::ACCEPTED, ""};
}

template <typename Message>
void MachineController::publish(const std::string& channel, const Message& message) {
  parts_.clients.broadcast(channel, message);
  if (parts_.safety) parts_.safety->broadcast(channel, message);
  parts_.telemetry.try_publish(channel, message);
}

void MachineController::publish_status() {
  status_due_ = false;
  next_status_ = Clock::now() + kStatusPeriod;
  trunnion::status_t status = status_;
  fill_status(parts_.machine, shown_state(), shown_report(), parts_.statistics, status);
  if (const std::string prepared = prepared_text(); shown_state() == MachineState::kIdle)
    status.message += status.message.empty() || prepared.empty() ? prepared : "; " + prepared;
  status.message = std::string(first_letters(status.message, CommandServer::kMessageBytesMax));
  status.detour = detour_name(
      (unheard() > 0 && supervisor_.state() == MachineState::kHolding) || jogs_.on_way() ? DetourState::kJogs
                                                                                         : report_.detour);
  status.bus_health = parts_.drives.health();
  for (const std::string& warning : parts_.drives.warnings()) status.warnings.push_back(warning);
  status.warning_count = static_cast<std::int32_t>(status.warnings.size());
  status.alarms_open = alarms_.open();
  status.alarm = alarms_.newest();
  const ProgramSwitches switches = parts_.programs.switches();
  status.block_delete = switches.block_delete;
  status.dry_run = switches.dry_run;
  add_corrections(report_, switches.corrections_off, parts_.map, parts_.chain, status);
  if (const ProgramStep* step = parts_.programs.step(present_step(report_)))
    add_step(*step, parts_.programs.tool_name(step->settings.current_tool), status);
  status.mist = (report_.coolant & 1) != 0;
  status.flood = (report_.coolant & 2) != 0;
  add_progress(status);
  // A machine that stands for no other reason.
  const bool stands = status.state == "running" && status.waits_for.empty() && status.override_now == 0;
  if (stands && (status.override_wanted == 0 || status.rapid_override == 0))
    status.waits_for =
        fmt::format("the {} override, which is at 0 %", status.override_wanted == 0 ? "feed" : "rapid");
  if (parts_.features) add_features(parts_.features->last(), status);
  status.time_us = unix_time_us();
  status.clock_us = daemon_clock_us();
  status.count = ++status_count_;
  publish(parts_.lcm.status_channel(), status);
}

void MachineController::publish_tables() {
  trunnion::tables_t fresh;
  if (parts_.programs.take_tables(fresh)) {
    tables_ = std::move(fresh);
    tables_due_ = true;
  }
  if (!tables_ || (!tables_due_ && Clock::now() < next_tables_)) return;
  tables_due_ = false;
  next_tables_ = Clock::now() + kTablesPeriod;
  tables_->time_us = unix_time_us();
  publish(parts_.lcm.tables_channel(), *tables_);
}

void MachineController::publish_alarms() {
  if (!alarms_.take_news() && !alarms_due_ && Clock::now() < next_alarms_) return;
  alarms_due_ = false;
  next_alarms_ = Clock::now() + kAlarmsPeriod;
  trunnion::alarms_t message = alarms_.message();
  message.time_us = unix_time_us();
  publish(parts_.lcm.alarms_channel(), message);
}

void MachineController::publish_motion() {
  next_motion_ = Clock::now() + kMotionPeriod;
  trunnion::motion_t motion = make_motion(report_);
  const ProgramStep* step = parts_.programs.step(present_step(report_));
  const bool on_path = report_.on_path && follows_program(report_);
  if (step && parts_.map)
    add_positions(shown_position(*parts_.map, *step, report_.q_plan, on_path, report_.y), motion);
  motion.time_us = unix_time_us();
  publish(parts_.lcm.motion_channel(), motion);
}

}  // namespace trn

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>

#include "app/client/running_daemons.h"
#include "app/daemon/command_server.h"
#include "app/daemon/direction_jog.h"
#include "app/daemon/held_mdi.h"
#include "app/daemon/jog_control.h"
#include "app/daemon/jog_order.h"
#include "app/daemon/machine_controller.h"
#include "app/daemon/supervisor.h"
#include "app/daemon/telemetry.h"
#include "app/session/place_record.h"
#include "app/session/program_step.h"
#include "core/axes.h"
#include "core/motion.h"
#include "interp/gcode/axis_words.h"
#include "interp/move.h"
#include "kernel/rt_messages.h"

// The controller's jogs, and what an operator may do while a program is held.
namespace trn {

namespace {

using trunnion::acknowledge_t;
using trunnion::command_t;

constexpr const char* kJogProgram = "jog";  // in the status, while one goes along a direction

}  // namespace

std::string MachineController::refuse_jog(const command_t& command) const {
  const MachineState state = supervisor_.state();
  const bool held = state == MachineState::kHolding && report_.stands_in_hold;
  if (held && report_.detour_full && command.value != 0)
    return "so many jogs have led away that the way back has no room for another; 'resume' leads back";
  const bool jogs = state == MachineState::kIdle || state == MachineState::kJogging || held;
  if (!jogs) return "";
  const JogOrder order = jogs_.order(command, report_);
  return order.refusal.empty() ? jogs_.held_by_other(order, command, Clock::now()) : order.refusal;
}

// Where the program waits, nothing behind is read.
HeldAt MachineController::held_at() const {
  using Wait = QueueEvent::Kind;
  if (report_.motion != MotionState::kPaused) return HeldAt::kPath;
  if (report_.waits_at.kind == Wait::kToolChange) return HeldAt::kToolChange;
  const bool stop =
      report_.waits_at.kind == Wait::kProgramStop || report_.waits_at.kind == Wait::kOptionalStop;
  return stop ? HeldAt::kStop : HeldAt::kPath;
}

// Of the tool whose length is in force; 0: none is known.
double MachineController::tool_length_mm() {
  const ProgramStep* step = parts_.programs.step(present_step(report_));
  return step ? in_mm(step->settings.tool_offset, step->settings.modal.inch).xyz.z() : 0;
}

void MachineController::hear_hold() {
  if (report_.detour == DetourState::kNone) q_hold_ = report_.q_plan;
  if (report_.motion != MotionState::kPaused) held_longer_mm_ = 0;
}

// By the table, the tool that the program waits for is longer by this than the one before it, mm; 0 where it
// waits for none. Its length is not in force yet, but it is in the spindle when the way back begins. A typed
// line has no place at which it could be begun anew: there the way back is the only one.
double MachineController::incoming_longer_mm() {
  const ProgramStep* step = stands_for_tool() ? parts_.programs.step(present_step(report_)) : nullptr;
  if (!step || !tables_ || !placed_) return 0;
  const auto length_mm = [this](int number) -> std::optional<double> {
    if (number == 0) return 0;
    const auto& numbers = tables_->tool_number;
    const auto found = std::find(numbers.begin(), numbers.end(), number);
    if (found == numbers.end()) return std::nullopt;
    return tables_->tool_z[static_cast<std::size_t>(found - numbers.begin())];
  };
  const auto before = length_mm(step->settings.current_tool), behind = length_mm(report_.waits_at.argument);
  return before && behind ? *behind - *before : 0;
}

// The way back leads to the joints' places at the stop, where a longer tool reaches deeper.
bool MachineController::needs_new_way() {
  constexpr double kDeeper_mm = 1, kAway = 1e-6;  // mm or rad
  const bool away = report_.detour != DetourState::kNone && q_hold_.size() == report_.q_plan.size() &&
                    (report_.q_plan - q_hold_).cwiseAbs().maxCoeff() > kAway;
  return supervisor_.state() == MachineState::kHolding && away &&
         std::max(held_longer_mm_, incoming_longer_mm()) > kDeeper_mm;
}

std::string MachineController::longer_text() {
  const double incoming_mm = incoming_longer_mm();
  if (incoming_mm <= held_longer_mm_)
    return fmt::format("the tool is {:.3f} mm longer than when the program stopped", held_longer_mm_);
  return fmt::format("{} is {:.3f} mm longer than the tool before it",
                     parts_.programs.tool_name(report_.waits_at.argument), incoming_mm);
}

// Who starts twice, as by a double click, has not put a tool in.
std::string MachineController::why_not_on(Event event) {
  if (supervisor_.state() != MachineState::kHolding) return "";
  if (event == Event::kStart && stands_for_tool())
    return fmt::format("the program runs already and waits for {}; 'resume' says that it is in the spindle",
                       parts_.programs.tool_name(report_.waits_at.argument));
  if (needs_new_way() && !placed_)
    return fmt::format(
        "{}, and the way back would bring its tip that much deeper; 'stop' the program, and begin it with "
        "'start --from LINE'",
        longer_text());
  return "";
}

// Over the safe height to where the tip was, and to the stop once more. Before the program is given up for
// that, all that follows the stop is tried with the new length.
CommandServer::Answer MachineController::resume_anew(const Ticket& ticket) {
  PlaceRecord place = *placed_;
  place.measured = measured_;
  if (const ProgramStep* step = parts_.programs.step(present_step(report_)))
    place.tool = step->settings.current_tool;
  const JointVec q = report_.q_plan;
  job_message_.clear();
  run_job(
      ticket,
      [this, place, q] {
        if (file_mark(place.program) != place.mark)
          throw ProgramError(
              fmt::format("{} has been changed since it was started; 'stop' it", place.program));
        parts_.programs.check_place(place, q);
      },
      [this, place, q, ticket] { lead_over_safe_height(place, q, ticket); }, Job::kFirst);
  return {acknowledge_t::WORKING, ""};
}

void MachineController::lead_over_safe_height(const PlaceRecord& place, const JointVec& q,
                                              const Ticket& ticket) {
  const std::string text = fmt::format(
      "{}: over the safe height its tip goes back to where it was, and the program stops there "
      "again, in line {}; 'resume' then goes on",
      longer_text(), place.line);
  spdlog::info("{}", text);
  run_job(
      ticket, clear_then([this, place, q] {
        parts_.programs.load_place(place, q, 0);
        parts_.programs.starts();
      }),
      [this, place, text] {
        block_delete_changes_ = place.block_delete_changes;
        began_ = place.began;
        measured_ = place.measured;
        progress_.begin();
        status_.message = job_message_ = text;
      },
      Job::kStart);
}

// What acts at once goes to the tick; offsets and tools go into the program, which goes on with them.
CommandServer::Answer MachineController::held_mdi(const std::string& text, const Ticket& ticket) {
  const ProgramStep* step = parts_.programs.step(present_step(report_));
  const double rpm = !step                      ? 0
                     : step->settings.modal.css ? std::abs(report_.spindle_rpm)
                                                : step->settings.modal.speed;
  const HeldMdi order = plan_held_mdi(text, rpm, report_.coolant, held_at());
  if (!order.refusal.empty()) return refused(order.refusal);
  if (!order.lines.empty()) {
    spdlog::info("'{}' while the program is held: {}", text, cause_);
    run_job(
        ticket, [this, lines = order.lines, q = report_.q_plan] { parts_.programs.obey_held(lines, q); },
        [this, before = tool_length_mm()] {
          held_longer_mm_ += tool_length_mm() - before;
          if (needs_new_way())
            job_message_ = fmt::format("{}; 'resume' leads over the safe height", longer_text());
        },
        Job::kSwitch);
    return {acknowledge_t::WORKING, ""};
  }
  spdlog::info("'{}' while the program is held: {}", text, cause_);
  for (const RtCommand& command : order.commands) post(command);
  return accepted();
}

CommandServer::Answer MachineController::jog(const command_t& command) {
  const JogOrder order = jogs_.order(command, report_);
  jogs_.hear(order.joint, command, Clock::now());
  jogs_.hold(order, command, Clock::now());
  post({RtCommand::Kind::kJog, order.way, order.speed, order.joint});
  return {acknowledge_t::ACCEPTED, order.remark};
}

// Along the path of the program that is held.
CommandServer::Answer MachineController::retrace(const command_t& command) {
  const bool moves = report_.detour == DetourState::kRetraces;
  if (supervisor_.state() != MachineState::kHolding)
    return refused("the motion is moved along its path while a program is held; 'hold' it first");
  if (command.value != 0 && moves) return refused("it moves along its path already; 'hold' stops it");
  if (report_.detour != DetourState::kNone && !moves)
    return refused(
        "the machine is away from the path, or an output is switched; jog it back, or let 'resume' lead it");
  if (command.value != 0 && !report_.stands_in_hold)
    return refused("the machine does not stand yet, or stands in a thread or a probe move");
  post({RtCommand::Kind::kRetrace, command.value});
  return accepted();
}

// Planned like a line of MDI, and ended by a stop on the path.
CommandServer::Answer MachineController::jog_along(const command_t& command, const Ticket& ticket) {
  if (jogs_along() && jogs_.continues(command)) {
    jogs_.hear_direction(command, Clock::now());
    return accepted();
  }
  const MachineState before = supervisor_.state();
  if (before == MachineState::kHolding && !jogs_along()) return jog_along_held(command);
  if (command.value == 0) {
    jog_let_go_ = jog_is_planned_;
    if (jog_is_planned_ || jogs_along()) machine_event(Event::kStop);
    return accepted();
  }
  const DirectionOrder order = jogs_.direction(command, report_, parts_.programs.step(0));
  if (before == MachineState::kIdle && !order.refusal.empty()) return refused(order.refusal);
  const Decision decision = supervisor_.handle(Event::kMdi, conditions(), "jog");
  if (!decision.refusal.empty()) return refusal(before, decision);
  enter_state(before);
  const CommandServer::Answer answer = mdi(order.program, ticket, [this, command, remark = order.remark] {
    status_.program = kJogProgram;
    job_message_ = remark;
    jogs_.hear_direction(command, Clock::now());
  });
  jog_is_planned_ = true;
  if (command.alive_ms > 0) jog_holder_ = ticket;
  return answer;
}

// By single jogs of the joints, so that the way back has their corners.
CommandServer::Answer MachineController::jog_along_held(const command_t& command) {
  if (command.value == 0) {
    end_held_jog();
    return accepted();
  }
  if (jogs_.on_way() && jogs_.continues(command)) {
    jogs_.hear_direction(command, Clock::now());
    return accepted();
  }
  if (!report_.stands_in_hold || report_.detour == DetourState::kJogs)
    return refused("the machine does not stand yet, or stands in a thread or a probe move; ask again");
  if (report_.detour_full)
    return refused(
        "so many jogs have led away that the way back has no room for another; 'resume' leads back");
  const DirectionOrder order = jogs_.begin_way(command, report_, parts_.programs.step(present_step(report_)));
  if (!order.refusal.empty()) return refused(order.refusal);
  spdlog::info("a jog along a direction while the program is held: {}", cause_);
  jogs_.hear_direction(command, Clock::now());
  go_on_along();
  return {acknowledge_t::ACCEPTED, order.remark};
}

// The next stretch, when the joints have come to rest behind the last.
void MachineController::go_on_along() {
  if (!jogs_.on_way() || unheard() > 0) return;
  const bool stands = report_.stands_in_hold && report_.detour != DetourState::kJogs;
  if (supervisor_.state() != MachineState::kHolding || report_.detour_full) return jogs_.forget_way();
  if (!stands) return;
  for (const JogStretch& stretch : jogs_.next_stretch(report_, parts_.programs.step(present_step(report_))))
    post({RtCommand::Kind::kJog, stretch.way, stretch.speed, stretch.joint});
}

void MachineController::end_held_jog() {
  for (const JogStretch& stretch : jogs_.stretch()) post({RtCommand::Kind::kJog, 0, 0, stretch.joint});
  jogs_.forget_way();
}

bool MachineController::jogs_along() const {
  const MachineState state = supervisor_.state();
  return (state == MachineState::kRunning || state == MachineState::kHolding) &&
         status_.program == kJogProgram;
}

// Whether who wanted the jog has let it go before it began.
bool MachineController::end_jog_plan() {
  jog_is_planned_ = false;
  jog_holder_.reset();
  return std::exchange(jog_let_go_, false);
}

// Nobody can be heard while a jog is planned, so its client cannot fall silent; but its connection can end.
void MachineController::let_go_for_the_dead() {
  if (!jog_holder_ || jog_let_go_ || commands_.reaches(*jog_holder_)) return;
  spdlog::warn("the jog along a direction does not begin: its client has gone");
  jog_let_go_ = true;
  machine_event(Event::kStop);
}

void MachineController::end_silent_jogs() {
  while (const auto joint = jogs_.take_silent(Clock::now())) {
    const bool direction = *joint == JogControl::kDirection;
    const MachineState state = supervisor_.state();
    if (direction && jogs_.on_way()) {
      spdlog::warn("the jog along a direction is ended: its client went silent");
      end_held_jog();
      continue;
    }
    if (direction ? !jogs_along() : state != MachineState::kJogging && state != MachineState::kHolding)
      continue;
    spdlog::warn("the jog of {} is ended: its client went silent",
                 direction ? "several joints" : parts_.machine.joints[static_cast<std::size_t>(*joint)].name);
    if (!direction) post({RtCommand::Kind::kJog, 0, 0, *joint});
    if (direction) machine_event(Event::kStop);
  }
}

}  // namespace trn

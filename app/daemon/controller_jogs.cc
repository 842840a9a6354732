#include <spdlog/spdlog.h>

#include <chrono>
#include <cstddef>
#include <string>

#include "app/daemon/command_server.h"
#include "app/daemon/direction_jog.h"
#include "app/daemon/held_mdi.h"
#include "app/daemon/jog_control.h"
#include "app/daemon/jog_order.h"
#include "app/daemon/machine_controller.h"
#include "app/daemon/supervisor.h"
#include "app/daemon/telemetry.h"
#include "app/session/program_step.h"
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
  return jogs ? jogs_.order(command, report_).refusal : "";
}

// The program stays as it is: what acts at once goes to the tick.
CommandServer::Answer MachineController::held_mdi(const std::string& text) {
  const ProgramStep* step = parts_.programs.step(present_step(report_));
  const HeldMdi order = plan_held_mdi(text, step ? step->settings.modal.speed : 0, report_.coolant);
  if (!order.refusal.empty()) return refused(order.refusal);
  spdlog::info("'{}' while the program is held: {}", text, cause_);
  for (const RtCommand& command : order.commands) post(command);
  return accepted();
}

CommandServer::Answer MachineController::jog(const command_t& command) {
  const JogOrder order = jogs_.order(command, report_);
  jogs_.hear(order.joint, command, Clock::now());
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
  if (command.value == 0) {
    if (jogs_along()) machine_event(Event::kStop);
    return accepted();
  }
  const MachineState before = supervisor_.state();
  if (before == MachineState::kHolding)
    return refused("while a program is held, axes are jogged one by one or together, without --along");
  const DirectionOrder order = jogs_.direction(command, report_, parts_.programs.step(0));
  if (before == MachineState::kIdle && !order.refusal.empty()) return refused(order.refusal);
  const Decision decision = supervisor_.handle(Event::kMdi, conditions());
  if (!decision.refusal.empty()) return refusal(before, decision);
  enter_state(before);
  return mdi(order.program, ticket, [this, command, remark = order.remark] {
    status_.program = kJogProgram;
    job_message_ = remark;
    jogs_.hear_direction(command, Clock::now());
  });
}

bool MachineController::jogs_along() const {
  const MachineState state = supervisor_.state();
  return (state == MachineState::kRunning || state == MachineState::kHolding) &&
         status_.program == kJogProgram;
}

void MachineController::end_silent_jogs() {
  while (const auto joint = jogs_.take_silent(Clock::now())) {
    const bool direction = *joint == JogControl::kDirection;
    const MachineState state = supervisor_.state();
    if (direction ? !jogs_along() : state != MachineState::kJogging && state != MachineState::kHolding)
      continue;
    spdlog::warn("the jog of {} is ended: its client went silent",
                 direction ? "several joints" : parts_.machine.joints[static_cast<std::size_t>(*joint)].name);
    if (!direction) post({RtCommand::Kind::kJog, 0, 0, *joint});
    if (direction) machine_event(Event::kStop);
  }
}

}  // namespace trn

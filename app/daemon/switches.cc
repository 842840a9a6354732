#include "app/daemon/switches.h"

#include <fmt/format.h>

#include "core/axes.h"

namespace trn {

namespace {

using trunnion::command_t;

void switch_correction(const std::string& name, bool on, const MachineJointMap* map,
                       const SetpointChain* chain, SwitchOrder& order) {
  order.name = fmt::format("correction '{}'", name);
  for (int i = 0; chain && i < chain->size(); ++i)
    if (chain->budget(i).name == name) {
      order.command = RtCommand{RtCommand::Kind::kCorrection, on ? 1.0 : 0.0, 0, i};
      return;
    }
  const bool pose = name == "geometric" && map && map->has_pose();
  const bool joint = name == "joint_table" && map && map->has_joint();
  if (!pose && !joint) {
    order.refusal = fmt::format("the machine has no correction '{}'; trunnion status lists them", name);
    return;
  }
  const int bit = pose ? kGeometricBit : kJointTableBit, off = order.programs.corrections_off;
  order.programs.corrections_off = static_cast<std::uint8_t>(on ? off & ~bit : off | bit);
  order.changes_plan = true;
}

}  // namespace

SwitchOrder plan_switch(const command_t& command, const ProgramSwitches& now, bool idle,
                        const MachineJointMap* map, const SetpointChain* chain) {
  const bool on = command.value != 0;
  SwitchOrder order;
  order.programs = now;
  const char* why = " is part of the plan: it";
  switch (command.verb) {
    case command_t::CORRECTION:
      switch_correction(command.text, on, map, chain, order);
      break;
    case command_t::OPTIONAL_STOP:
      order.name = "optional stop";
      order.programs.optional_stop = on;
      order.command = RtCommand{RtCommand::Kind::kOptionalStop, on ? 1.0 : 0.0};
      break;
    case command_t::DRY_RUN:
      order.name = "dry run";
      order.programs.dry_run = on;
      order.changes_plan = true;
      break;
    case command_t::MACHINE_LOCK:
      order.name = "machine lock";
      order.command = RtCommand{RtCommand::Kind::kMachineLock, on ? 1.0 : 0.0};
      order.changes_plan = true;  // where it begins
      why = "";
      break;
    case command_t::BLOCK_DELETE:
      order.name = "block delete";
      order.programs.block_delete = on;
      order.changes_plan = idle;
      order.changes_reading = !idle;
      break;
    default:
      order.refusal = fmt::format("verb {} switches nothing", command.verb);
      return order;
  }
  if (order.changes_plan && !idle)
    order.refusal = fmt::format("{}{} can be switched while the machine is idle", order.name, why);
  return order;
}

}  // namespace trn

#include "hal/can/node_safety_config.h"

#include <fmt/format.h>

#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "core/axes.h"
#include "core/periods.h"
#include "core/signal_name.h"
#include "hal/can/brake.h"

namespace trn {

namespace {

// A quick stop from full speed, and a little more: after that the brake closes whatever the encoder says.
std::uint32_t stop_periods(const Machine& machine, int joint) {
  const JointLimit& limit = machine.joints[static_cast<std::size_t>(joint)].limit;
  return periods_of(limit.velocity / limit.acceleration + 0.5, machine.period_s);
}

Brake::Config read_brake(const Machine& machine, const ConfigTable& table, int joint) {
  Brake::Config brake;
  brake.fitted = true;
  const SignalName output = read_signal_name(machine, table, "output");
  if (output.is_input()) throw table.error("output", "a brake is released by an output");
  if (output.of_drive() && output.joint != joint)
    throw table.error("output", fmt::format("the brake of joint {} is released by its own drive or by [io]",
                                            machine.joints[static_cast<std::size_t>(joint)].name));
  if (!output.of_drive() && !machine.root.has("io"))
    throw table.error("output", "the machine has no section [io], whose output this would be");
  brake.of_drive = output.of_drive();
  brake.output = output.number;
  brake.inverted = table.choice("released_by", {"on", "off"}, "on") == "off";
  brake.release_periods = periods_of(table.number("release_s", Range{0, 10}), machine.period_s);
  brake.close_periods = periods_of(table.number("close_s", Range{0, 10}), machine.period_s);
  brake.stop_periods_max = stop_periods(machine, joint);
  return brake;
}

StoSign read_sto(const ConfigTable& table) {
  StoSign sign;
  const std::string text = table.text("sto", "");
  if (text.empty()) return sign;
  sign.known = true;
  sign.when_on = text[0] != '!';
  unsigned index = 0, bit = 0;
  int end = 0;
  const char* from = text.c_str() + (sign.when_on ? 0 : 1);
  const bool whole = std::sscanf(from, "0x%4x:%2u%n", &index, &bit, &end) == 2 && from[end] == 0;
  sign.in_statusword = index == 0x6041;
  sign.bit = static_cast<int>(bit);
  const bool legal = whole && ((index == 0x6041 && bit < 16) || (index == 0x60FD && bit < 32));
  if (!legal)
    throw table.error("sto", fmt::format("'{}' is no sign of Safe Torque Off; legal: \"0x6041:14\", "
                                         "\"0x60FD:3\", with ! where the bit is off",
                                         text));
  return sign;
}

}  // namespace

void read_node_safety(const Machine& machine, const ConfigTable& table, NodeLink::Config& node) {
  node.sto = read_sto(table);
  node.reads_inputs = node.sto.known && !node.sto.in_statusword;
  for (const ConfigTable& signal : machine.root.tables_if("signal")) {
    const SignalName from = read_signal_name(machine, signal, "from"),
                     to = read_signal_name(machine, signal, "to");
    node.reads_inputs |= from.kind == SignalName::Kind::kDriveInput && from.joint == node.joint;
    if (to.kind == SignalName::Kind::kDriveOutput && to.joint == node.joint)
      node.output_mask |= std::uint32_t{1} << to.number;
  }
  const std::optional<ConfigTable> safety = machine.root.table_if("safety");
  if (!safety) return;
  std::vector<std::string> names;
  for (const Joint& joint : machine.joints) names.push_back(joint.name);
  for (const ConfigTable& brake : safety->tables_if("brake"))
    if (brake.choice("joint", names) == names[static_cast<std::size_t>(node.joint)]) {
      if (node.brake.fitted) throw brake.error("joint", "this joint has its brake already");
      node.brake = read_brake(machine, brake, node.joint);
      node.axis.braked = true;
    }
  for (const ConfigTable& input : safety->tables_if("input")) {
    const SignalName from = read_signal_name(machine, input, "from");
    node.reads_inputs |= from.kind == SignalName::Kind::kDriveInput && from.joint == node.joint;
  }
}

}  // namespace trn

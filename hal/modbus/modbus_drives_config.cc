#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/axes.h"
#include "core/config.h"
#include "core/machine.h"
#include "core/periods.h"
#include "core/units.h"
#include "hal/can/cia402.h"
#include "hal/can/cia402_axis.h"
#include "hal/modbus/field_devices.h"
#include "hal/modbus/modbus_drives.h"
#include "hal/modbus/modbus_link.h"

namespace trn {

namespace {

constexpr double kShareMax = 0.7;
// unit, function, address, count, byte count, four registers, CRC; and so on (protocol 1.1b3, 6.4 and 6.12)
constexpr double kWriteCharacters = 9 + 8 + 8, kReadCharacters = 8 + 5 + 8;

ModbusConfig::Line read_line(const ConfigTable& table) {
  ModbusConfig::Line line;
  line.name = table.text("name");
  const std::string address = table.text("address");
  try {
    line.address = parse_modbus_address(address);
  } catch (const std::runtime_error& error) {
    throw table.error("address", error.what());
  }
  line.timeout_s = table.number("timeout_s", 0.1, Range{0.001, 60});
  return line;
}

// A serial line has one master; two threads of ours would be two.
void check_line(const Machine& machine, const ConfigTable& table, const ModbusConfig::Line& line) {
  for (const ModbusConfig::Line& other : read_modbus(machine.root).lines)
    if (!line.address.device.empty() && other.address.device == line.address.device)
      throw table.error("address", fmt::format("{} is used by [[modbus.line]] '{}' already; drives need a "
                                               "line of their own",
                                               line.address.device, other.name));
}

Cia402Axis::Config read_axis(const ConfigTable& table, const Joint& joint, double period_s,
                             std::uint32_t missed_max) {
  const bool rotary = joint.kind == JointKind::kRotary;
  const double unit = rotary ? kRadPerDeg : 1;
  const std::string suffix = rotary ? "deg" : "mm";
  Cia402Axis::Config axis;
  axis.mode = table.choice("mode", {"pp", "csp"}, "pp") == "pp" ? Cia402Mode::kProfilePosition
                                                                : Cia402Mode::kCyclicPosition;
  const double counts = table.number("counts_per_" + suffix, kPositive) / unit;
  const double most = std::max(std::abs(joint.limit.min), std::abs(joint.limit.max)) * counts;
  if (most >= 2147483647.0)
    throw table.error(
        "counts_per_" + suffix,
        fmt::format("joint {} would reach {:.3g} counts, 32 bits hold 2147483647", joint.name, most));
  axis.counts_per_unit = table.boolean("reverse", false) ? -counts : counts;
  axis.absolute = table.boolean("absolute", false);
  axis.following_error_max = unit * table.number("following_error_" + suffix, 0.0, kNotNegative);
  // Answers may be as old as the periods that may be missed, so the axis may have gone as far in that time.
  axis.step_max = (3.0 + missed_max) * joint.limit.velocity * period_s + 10 / counts;
  return axis;
}

ModbusAxisConfig read_drive(const Machine& machine, const ConfigTable& table,
                            const std::vector<std::string>& lines, std::uint32_t missed_max) {
  std::vector<std::string> joints;
  for (const Joint& joint : machine.joints) joints.push_back(joint.name);
  const std::string joint = table.choice("joint", joints);
  const std::string line =
      lines.size() == 1 ? table.choice("line", lines, lines[0]) : table.choice("line", lines);
  ModbusAxisConfig out;
  out.joint = static_cast<int>(std::find(joints.begin(), joints.end(), joint) - joints.begin());
  out.line = static_cast<std::size_t>(std::find(lines.begin(), lines.end(), line) - lines.begin());
  out.unit = static_cast<int>(table.integer("unit", 1, Range{1, 247}));
  out.name = fmt::format("{} unit {} (joint {})", line, out.unit, joint);
  // Four registers from here on, so the last legal beginning is 65532.
  out.command = static_cast<int>(table.integer("command", Range{0, 65532}));
  out.answer = static_cast<int>(table.integer("answer", Range{0, 65532}));
  const bool input = table.choice("answer_table", {"input", "holding"}, "input") == "input";
  out.answer_table = input ? ModbusTable::kInput : ModbusTable::kHolding;
  if (!input && std::abs(out.command - out.answer) < 4)
    throw table.error("answer", "the four registers of 'answer' must not overlap those of 'command'");
  out.turnaround_s = 1e-3 * table.number("turnaround_ms", 5.0, Range{0, 1000});
  out.axis =
      read_axis(table, machine.joints[static_cast<std::size_t>(out.joint)], machine.period_s, missed_max);
  return out;
}

void check_budget(const ModbusDrivesConfig& config, std::size_t line, const ConfigTable& table) {
  double sum_s = 0;
  std::string text;
  for (const ModbusAxisConfig& axis : config.axes) {
    if (axis.line != line) continue;
    const double time_s = exchange_time_s(config.lines[line].address, axis);
    sum_s += time_s;
    text += fmt::format("\n  {}: {:.1f} ms on the line + 2 x {:g} ms turnaround = {:.1f} ms", axis.name,
                        1000 * (time_s - 2 * axis.turnaround_s), 1000 * axis.turnaround_s, 1000 * time_s);
  }
  if (sum_s <= kShareMax * config.period_s) return;
  throw table.error(
      "address",
      fmt::format("line '{}' cannot exchange with its drives in a period of {:g} ms, of which 70 % may be "
                  "used:{}\n  together {:.1f} ms of {:.1f} ms\n  the smallest period that would do: "
                  "machine.period_s = {:.3f}; or a faster line, or one more",
                  config.lines[line].name, 1000 * config.period_s, text, 1000 * sum_s,
                  1000 * kShareMax * config.period_s, std::ceil(1000 * sum_s / kShareMax) / 1000));
}

void check_twice(const ModbusDrivesConfig& config, const ModbusAxisConfig& axis, const ConfigTable& table) {
  for (const ModbusAxisConfig& other : config.axes) {
    if (other.joint == axis.joint)
      throw table.error("joint", fmt::format("this joint has a drive already: {}", other.name));
    if (other.line == axis.line && other.unit == axis.unit)
      throw table.error("unit", fmt::format("unit {} is there already: {}", axis.unit, other.name));
  }
}

}  // namespace

double exchange_time_s(const ModbusAddress& address, const ModbusAxisConfig& axis) {
  // Four frames, request and answer of both exchanges, and a silence behind each.
  const double characters = kWriteCharacters + kReadCharacters + 4 * kRtuSilence_characters;
  const double wire_s = address.host.empty() ? characters * kRtuBitsPerCharacter / address.baud : 0;
  return wire_s + 2 * axis.turnaround_s;
}

ModbusDrivesConfig read_modbus_drives(const Machine& machine, const ConfigTable& drives) {
  if (machine.root.has("feed_forward"))
    throw machine.root.error("feed_forward", fmt::format("drives on Modbus are told a place and go there by "
                                                         "themselves, over a period of {:g} s: speed and "
                                                         "torque told in advance would be old by then. Leave "
                                                         "[feed_forward] out; the drive's manual may have "
                                                         "one of its own",
                                                         machine.period_s));
  ModbusDrivesConfig config;
  config.period_s = machine.period_s;
  config.missed_max = static_cast<std::uint32_t>(drives.integer("missed_max", 5, Range{1, 100}));
  const double enable_s = drives.number("enable_timeout_s", 5.0, kPositive);
  const double homing_s = drives.number("homing_timeout_s", 120.0, kPositive);
  std::vector<std::string> names;
  const std::vector<ConfigTable> lines = drives.tables("line");
  for (const ConfigTable& table : lines) {
    config.lines.push_back(read_line(table));
    check_line(machine, table, config.lines.back());
    if (std::find(names.begin(), names.end(), config.lines.back().name) != names.end())
      throw table.error("name", fmt::format("line '{}' is there already", config.lines.back().name));
    names.push_back(config.lines.back().name);
  }
  const std::vector<ConfigTable> axes = drives.tables("axis");
  for (const ConfigTable& table : axes) {
    ModbusAxisConfig axis = read_drive(machine, table, names, config.missed_max);
    check_twice(config, axis, table);
    axis.axis.enable_periods_max = periods_of(enable_s, machine.period_s);
    axis.axis.homing_periods_max = periods_of(homing_s, machine.period_s);
    config.axes.push_back(axis);
  }
  for (std::size_t i = 0; i < lines.size(); ++i) check_budget(config, i, lines[i]);
  if (axes.size() != machine.joints.size())
    throw drives.error("axis", fmt::format("{} joints need as many drives; there are {} [[drives.axis]]",
                                           machine.joints.size(), axes.size()));
  return config;
}

}  // namespace trn

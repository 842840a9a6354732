#include "sim/simulated_io.h"

#include <fmt/format.h>

#include "core/periods.h"

namespace trn {

namespace {

const Range kIoNumber{0, kMaxIo - 1};

// `input` and `output` are digital, `analog_input` and `analog_output` the others.
int number_of(const ConfigTable& table, const std::string& key, bool analog) {
  return static_cast<int>(table.integer(analog ? "analog_" + key : key, kIoNumber));
}

SimulatedIo::Wire read_wire(const Machine& machine, const ConfigTable& table) {
  SimulatedIo::Wire wire;
  wire.analog = table.has("analog_input");
  wire.input = number_of(table, "input", wire.analog);
  wire.output = number_of(table, "output", wire.analog);
  wire.delay_periods = periods_of(table.number("delay_s", 0, kNotNegative), machine.period_s);
  return wire;
}

SimulatedIo::ScriptedInput read_script(const Machine& machine, const ConfigTable& table) {
  SimulatedIo::ScriptedInput event;
  event.period = periods_of(table.number("at_s", kNotNegative), machine.period_s);
  event.analog = table.has("analog_input");
  event.input = number_of(table, "input", event.analog);
  event.value = table.number("value");
  return event;
}

SimulatedSpindle::Config read_spindle(const Machine& machine, const ConfigTable& io) {
  SimulatedSpindle::Config config;
  config.period_s = machine.period_s;
  const std::optional<ConfigTable> table = io.table_if("spindle");
  if (!table) return config;
  config.acceleration_rpm_s = table->number("acceleration_rpm_s", 0, kNotNegative);
  config.lag_s = table->number("lag_s", 0, kNotNegative);
  config.load_share = table->number("load_share", 0, Range{0, 0.5});
  config.load_hz = table->number("load_hz", config.load_hz, kPositive);
  return config;
}

}  // namespace

SimulatedIo::SimulatedIo(const Config& config, const Kinematics& kinematics)
    : script_(config.script),
      table_(config.table, kinematics),
      touch_(config.touch),
      spindle_(config.spindle) {
  for (const Wire& wire : config.wires) wires_.push_back({wire, 0, 0});
}

void SimulatedIo::exchange(const IoOutputs& outputs, const IoPlace& place, IoInputs& inputs) TRN_RT {
  follow_wires(outputs);
  run_script();
  if (!table_.empty()) inputs_.probe = touch_.closed(table_.gap(place.q, place.tool_offset));
  spindle_.step(outputs, inputs_);
  ++period_;
  inputs = inputs_;
}

void SimulatedIo::follow_wires(const IoOutputs& outputs) TRN_RT {
  for (LiveWire& live : wires_) {
    const auto i = static_cast<std::size_t>(live.wire.output);
    const double value = live.wire.analog ? outputs.analog[i] : static_cast<double>(outputs.digital >> i & 1);
    // A change begins the delay anew: an output that goes back in time never reaches the input, like a slow
    // valve.
    if (value != live.value) live.since = period_;
    live.value = value;
    if (period_ - live.since == live.wire.delay_periods) set(live.wire.input, live.wire.analog, value);
  }
}

void SimulatedIo::run_script() TRN_RT {
  for (const ScriptedInput& event : script_)
    if (event.period == period_) set(event.input, event.analog, event.value);
}

void SimulatedIo::set(int input, bool analog, double value) TRN_RT {
  const auto i = static_cast<std::size_t>(input);
  const std::uint64_t bit = std::uint64_t{1} << i;
  if (analog)
    inputs_.analog[i] = value;
  else
    inputs_.digital = value != 0 ? inputs_.digital | bit : inputs_.digital & ~bit;
}

SimulatedIo::Config read_simulated_io(const Machine& machine, const ConfigTable& io) {
  SimulatedIo::Config config;
  for (const ConfigTable& table : io.tables_if("wire")) {
    const SimulatedIo::Wire wire = read_wire(machine, table);
    for (const SimulatedIo::Wire& other : config.wires)
      if (other.analog == wire.analog && other.input == wire.input)
        throw table.error(wire.analog ? "analog_input" : "input",
                          fmt::format("input {} has its wire already", wire.input));
    config.wires.push_back(wire);
  }
  for (const ConfigTable& table : io.tables_if("script"))
    config.script.push_back(read_script(machine, table));
  config.table = read_touch_table(machine, io);
  config.touch = read_touch_switch(io);
  if (const auto probe = io.table_if("probe"); probe && probe->has("length_mm"))
    config.table.length_mm = probe->number("length_mm", kNotNegative);
  config.spindle = read_spindle(machine, io);
  return config;
}

}  // namespace trn

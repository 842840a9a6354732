#include "sim/modbus/emulated_cabinet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace trn {

namespace {
constexpr double kRpmPerS = 12'000, kAtSpeedRpm = 20;

std::vector<std::string> names_of(const ModbusConfig& devices) {
  std::vector<std::string> names;
  for (const ModbusDeviceConfig& device : devices.devices)
    for (const ModbusValueConfig& value : device.values) names.push_back(value.name);
  return names;
}
}  // namespace

std::vector<EmulatedValue> read_emulated_values(const ConfigTable& root, const ModbusConfig& devices) {
  std::vector<EmulatedValue> out;
  const auto section = root.table_if("modbus");
  if (!section) return out;
  const std::vector<std::string> names = names_of(devices);
  for (const ConfigTable& table : section->tables_if("emulation")) {
    out.push_back({table.choice("value", names), table.number("start", 0.0, kAnyNumber),
                   table.number("rate_per_s", 0.0, kAnyNumber)});
    for (std::size_t i = 0; i + 1 < out.size(); ++i)
      if (out[i].name == out.back().name) throw table.error("value", "this value is emulated already");
  }
  return out;
}

EmulatedCabinet::EmulatedCabinet(const ModbusIoConfig& config, const std::vector<EmulatedValue>& values)
    : config_(config), values_(values) {
  const ModbusConfig& devices = config_.devices;
  for (std::size_t i = 0; i < devices.lines.size(); ++i) {
    std::vector<int> units;
    for (const ModbusDeviceConfig& device : devices.devices)
      if (device.line == i) units.push_back(device.unit);
    lines_.push_back(std::make_unique<EmulatedLine>(devices.lines[i].address, units));
  }
  for (const std::string& name : names_of(devices)) set(name, 0);
  // A first step, so that the inputs have their values before anybody asks.
  step(0);
}

EmulatedCabinet::Place EmulatedCabinet::place(const std::string& name) const {
  for (const ModbusDeviceConfig& device : config_.devices.devices)
    for (const ModbusValueConfig& value : device.values)
      if (value.name == name) return {&device, &value};
  throw std::runtime_error(fmt::format("no Modbus device has a value '{}'", name));
}

void EmulatedCabinet::set(const std::string& name, double value) {
  if (name.empty()) return;
  const Place at = place(name);
  const auto raw = static_cast<std::int32_t>(std::lround(value / at.value->scale));
  lines_[at.device->line]->set(at.device->unit, at.value->table, at.value->address,
                               static_cast<std::uint16_t>(raw));
}

double EmulatedCabinet::get(const std::string& name) const {
  if (name.empty()) return 0;
  const Place at = place(name);
  const std::uint16_t raw = lines_[at.device->line]->get(at.device->unit, at.value->table, at.value->address);
  return at.value->scale * (at.value->is_signed ? static_cast<std::int16_t>(raw) : raw);
}

void EmulatedCabinet::trouble(const std::string& name, const EmulatedLine::Trouble& trouble) {
  for (const ModbusDeviceConfig& device : config_.devices.devices)
    if (device.name == name) return lines_[device.line]->trouble(device.unit, trouble);
  throw std::runtime_error(fmt::format("there is no Modbus device '{}'", name));
}

void EmulatedCabinet::step_spindle(double dt_s) {
  const ModbusIoConfig::Spindle& spindle = config_.spindle;
  const bool runs = spindle.run.empty() || get(spindle.run) != 0;
  const double wanted = runs ? get(spindle.speed) : 0;
  // The spindle comes up at a constant rate, so that a program really has to wait for its speed.
  rpm_ += std::clamp(wanted - rpm_, -kRpmPerS * dt_s, kRpmPerS * dt_s);
  set(spindle.actual, rpm_);
  set(spindle.at_speed, std::abs(wanted - rpm_) <= kAtSpeedRpm ? 1 : 0);
}

void EmulatedCabinet::step(double dt_s) {
  time_s_ += dt_s;
  for (const EmulatedValue& value : values_) set(value.name, value.start + value.rate_per_s * time_s_);
  step_spindle(dt_s);
  // The first inputs are wired to the outputs of the same number, so that M66 has something to wait for.
  const std::size_t wires = std::min(config_.digital_inputs.size(), config_.digital_outputs.size());
  for (std::size_t i = 0; i < wires; ++i) set(config_.digital_inputs[i], get(config_.digital_outputs[i]));
}

}  // namespace trn

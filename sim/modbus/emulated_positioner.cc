#include "sim/modbus/emulated_positioner.h"

#include <cmath>

#include "core/axes.h"
#include "hal/can/eds.h"
#include "hal/modbus/modbus_link.h"
#include "sim/simulated_drives.h"

namespace trn {

namespace {

constexpr double kClock_s = 0.001;

void add(ObjectDictionary& dictionary, std::uint16_t index, DataType type, std::int64_t value = 0,
         std::uint8_t sub = 0) {
  DictionaryEntry entry;
  entry.type = type;
  entry.value = encode_integer(type, value);
  entry.writable = true;
  dictionary.entries[{index, sub}] = entry;
}

// What EmulatedDrive works on; profile speed and acceleration are those of the joint.
ObjectDictionary objects_of(const Joint& joint, double counts_per_unit) {
  const auto counts = [&](double value) { return std::llround(std::abs(value * counts_per_unit)); };
  ObjectDictionary out;
  add(out, 0x6040, DataType::kUnsigned16);
  add(out, 0x6041, DataType::kUnsigned16);
  add(out, 0x6060, DataType::kInteger8);
  add(out, 0x6061, DataType::kInteger8);
  add(out, 0x6064, DataType::kInteger32);
  add(out, 0x607A, DataType::kInteger32);
  add(out, 0x6081, DataType::kUnsigned32, counts(joint.limit.velocity));
  add(out, 0x6083, DataType::kUnsigned32, counts(joint.limit.acceleration));
  add(out, 0x6098, DataType::kInteger8, 5);
  return out;
}

}  // namespace

SimulatedJoint::Config read_positioner_plant(const Machine& machine, const ConfigTable& drives, int joint) {
  const auto section = drives.table_if("emulation");
  Machine own = machine;
  // A positioning drive closes its loop every millisecond, however seldom the line asks.
  own.period_s = kClock_s;
  const ConfigTable table = section ? *section : parse_config("", machine.root.file());
  SimulatedJoint::Config plant = read_simulated_drives(own, table).joints[static_cast<std::size_t>(joint)];
  plant.start_up_periods = 0;
  return plant;
}

EmulatedPositioners::EmulatedPositioners(const Machine& machine, const ModbusDrivesConfig& config,
                                         const ConfigTable& drives) {
  for (std::size_t i = 0; i < config.lines.size(); ++i) {
    std::vector<int> units;
    for (const ModbusAxisConfig& axis : config.axes)
      if (axis.line == i) units.push_back(axis.unit);
    lines_.push_back(std::make_unique<EmulatedLine>(config.lines[i].address, units));
  }
  for (const ModbusAxisConfig& axis : config.axes) {
    SimulatedJoint::Config plant = read_positioner_plant(machine, drives, axis.joint);
    // A drive with an absolute encoder knows its place from the start.
    plant.homed = axis.axis.absolute;
    Axis out{axis, nullptr, nullptr};
    const Joint& joint = machine.joints[static_cast<std::size_t>(axis.joint)];
    out.store = std::make_unique<ObjectStore>(objects_of(joint, axis.axis.counts_per_unit));
    EmulatedDrive::Config drive{plant, axis.axis.counts_per_unit, kClock_s};
    // From one setpoint of the line to the next the drive goes evenly, in as many steps of its own clock.
    drive.interpolation_steps = static_cast<int>(std::lround(config.period_s / kClock_s));
    out.drive = std::make_unique<EmulatedDrive>(drive, *out.store);
    axes_.push_back(std::move(out));
    const ModbusAxisConfig& at = axes_.back().config;
    lines_[at.line]->set_block(at.unit, ModbusTable::kHolding, at.command, {0, 0, 0, 0});
    give_answer(axes_.back());
  }
}

void EmulatedPositioners::take_command(Axis& axis) {
  const ModbusAxisConfig& at = axis.config;
  const auto words = lines_[at.line]->block(at.unit, ModbusTable::kHolding, at.command, 4);
  axis.store->set({0x6040, 0}, words[0]);
  axis.store->set({0x6060, 0}, static_cast<std::int16_t>(words[1]));
  axis.store->set({0x607A, 0}, static_cast<std::int32_t>(std::uint32_t{words[2]} << 16 | words[3]));
}

void EmulatedPositioners::give_answer(Axis& axis) {
  const ModbusAxisConfig& at = axis.config;
  const auto position = static_cast<std::uint32_t>(axis.store->integer({0x6064, 0}));
  lines_[at.line]->set_block(
      at.unit, at.answer_table, at.answer,
      {static_cast<std::uint16_t>(axis.store->integer({0x6041, 0})),
       static_cast<std::uint16_t>(axis.store->integer({0x6061, 0})),
       static_cast<std::uint16_t>(position >> 16), static_cast<std::uint16_t>(position)});
}

void EmulatedPositioners::step(double dt_s) {
  left_s_ += dt_s;
  // What is left of the period goes into the next call, so that no time is lost over a long run.
  for (; left_s_ >= kClock_s; left_s_ -= kClock_s) {
    for (Axis& axis : axes_) {
      take_command(axis);
      axis.drive->step();
      give_answer(axis);
    }
  }
}

void EmulatedPositioners::trouble(std::size_t axis, const EmulatedLine::Trouble& trouble) {
  lines_[axes_[axis].config.line]->trouble(axes_[axis].config.unit, trouble);
}

}  // namespace trn

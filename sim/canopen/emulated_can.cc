#include "sim/canopen/emulated_can.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/fault.h"
#include "core/units.h"
#include "hal/can/brake.h"
#include "hal/can/bus.h"
#include "hal/can/can_node_config.h"
#include "hal/can/cia402.h"
#include "hal/can/gantry.h"
#include "hal/can/node_link.h"
#include "sim/canopen/emulated_drive.h"
#include "sim/canopen/emulated_homing.h"
#include "sim/canopen/emulated_units.h"
#include "sim/hanging_load.h"
#include "sim/mechanism_config.h"
#include "sim/simulated_drives.h"
#include "sim/simulated_joint.h"

namespace trn {

namespace {

// What a drive does not say of its units the config does, as for the master.
EmulatedUnits emulated_units(const CanNodeConfig& node, const Joint& joint) {
  EmulatedUnits out;
  out.counts_per_revolution = node.counts_per_revolution;
  if (joint.kind != JointKind::kRotary) out.counts_per_m = 1000 * std::abs(node.link.axis.counts_per_unit);
  out.velocity = 1 / node.units.velocity;
  out.acceleration = 1 / node.units.acceleration;
  return out;
}

/// What is true of one motor and not of its joint: where it stands, and where its home switch is.
struct MotorTruth {
  double start = 0, switch_offset = 0;  ///< beside those of the joint, mm or rad
  HangingLoad::Config load;
  std::uint32_t inputs_on = 0;
  std::uint32_t serial = 0;
  bool without_id = false, stores = true, switches_swapped = false;
};

HangingLoad::Config read_load(const ConfigTable& table, double unit, double period_s) {
  static const std::vector<std::string> kWays = {"negative", "no", "positive"};
  HangingLoad::Config load;
  const std::string way = table.choice("falls", kWays, "no");
  load.falls = static_cast<int>(std::find(kWays.begin(), kWays.end(), way) - kWays.begin()) - 1;
  // A turned axis falls as one of 100 mm of radius would.
  load.gravity = unit == 1 ? 9810 : 98.1;
  const auto periods = [&](double time_s) {
    return static_cast<std::uint32_t>(std::lround(time_s / period_s));
  };
  load.release_periods = periods(table.number("brake_release_s", 0.05, Range{0, 10}));
  load.close_periods = periods(table.number("brake_close_s", 0.05, Range{0, 10}));
  load.period_s = period_s;
  return load;
}

std::uint32_t read_inputs_on(const ConfigTable& table) {
  std::uint32_t on = 0;
  if (!table.has("inputs_on")) return on;
  for (const double bit : table.numbers("inputs_on")) {
    if (bit < 0 || bit > 31 || bit != std::floor(bit))
      throw table.error("inputs_on", "'inputs_on' is a list of bits of 0x60FD, 0 to 31");
    on |= std::uint32_t{1} << static_cast<unsigned>(bit);
  }
  return on;
}

// [[drives.emulation.motor]]; a gantry's motors differ, which nobody has told the master.
std::vector<std::vector<MotorTruth>> read_motors(const Machine& machine, const CanDrivesConfig& config,
                                                 const ConfigTable& emulation) {
  std::vector<std::vector<MotorTruth>> out;
  std::vector<std::string> names;
  for (const CanBusConfig& bus : config.buses) {
    out.emplace_back(bus.nodes.size());
    for (const CanNodeConfig& node : bus.nodes)
      names.push_back(fmt::format("{}:{}", bus.interface, node.link.id));
  }
  std::vector<std::string> seen;
  for (const ConfigTable& table : emulation.tables_if("motor")) {
    const std::string name = table.text("node");
    if (std::find(seen.begin(), seen.end(), name) != seen.end())
      throw table.error("node", fmt::format("drive '{}' has its table already", name));
    seen.push_back(name);
    if (std::find(names.begin(), names.end(), name) == names.end())
      throw table.error("node",
                        fmt::format("there is no drive '{}'; legal: {}", name, fmt::join(names, ", ")));
    for (std::size_t b = 0; b < out.size(); ++b)
      for (std::size_t i = 0; i < out[b].size(); ++i) {
        const NodeLink::Config& link = config.buses[b].nodes[i].link;
        if (fmt::format("{}:{}", config.buses[b].interface, link.id) != name) continue;
        const bool rotary = machine.joints[static_cast<std::size_t>(link.joint)].kind == JointKind::kRotary;
        const double unit = rotary ? kRadPerDeg : 1;
        const char* suffix = rotary ? "deg" : "mm";
        out[b][i].load = read_load(table, unit, machine.period_s);
        out[b][i].inputs_on = read_inputs_on(table);
        out[b][i].serial = static_cast<std::uint32_t>(table.integer("serial", 0, Range{0, 4294967295.0}));
        out[b][i].without_id = table.boolean("without_id", false);
        out[b][i].stores = table.boolean("stores", true);
        out[b][i].switches_swapped = table.boolean("switches_swapped", false);
        out[b][i].start = unit * table.number(fmt::format("start_offset_{}", suffix), 0.0, kAnyNumber);
        out[b][i].switch_offset =
            unit * table.number(fmt::format("switch_offset_{}", suffix), 0.0, kAnyNumber);
      }
  }
  return out;
}

// The switches lie so that the method of the config finds the home point where the config has it.
EmulatedHoming::Switches switches_of(const CanNodeConfig& node, const Joint& joint, double index_distance,
                                     double switch_offset, const ConfigTable& emulation) {
  const bool rotary = joint.kind == JointKind::kRotary;
  const double unit = rotary ? kRadPerDeg : 1;
  const auto key = [&](std::string_view name) { return fmt::format("{}_{}", name, rotary ? "deg" : "mm"); };
  const double width = unit * emulation.number(key("home_switch_width"), 10.0, kPositive);
  const double pitch = unit * emulation.number(key("index_pitch"), 5.0, kPositive);
  EmulatedHoming::Switches out =
      EmulatedHoming::at_home(node.homing_method, node.link.axis.counts_per_unit < 0,
                              node.home - node.square + switch_offset, index_distance, width);
  // An index that is farther from the switch than the pitch would not be the first one.
  out.index_pitch = std::max(pitch, 2 * index_distance);
  return out;
}

}  // namespace

std::vector<std::vector<std::unique_ptr<EmulatedNode>>> make_emulated_nodes(const Machine& machine,
                                                                            const CanDrivesConfig& config,
                                                                            const ConfigTable& drives) {
  const auto section = drives.table_if("emulation");
  const ConfigTable table = section ? *section : parse_config("", machine.root.file());
  const auto sync_max = static_cast<unsigned>(table.integer("sync_periods_max", 5, Range{2, 100000}));
  SimulatedDrives::Config plants = read_simulated_drives(machine, table);
  const std::vector<std::vector<MotorTruth>> motors = read_motors(machine, config, table);
  std::vector<std::vector<std::unique_ptr<EmulatedNode>>> out;
  for (const CanBusConfig& bus : config.buses) {
    out.emplace_back();
    for (const CanNodeConfig& node : bus.nodes) {
      const Joint& joint = machine.joints[static_cast<std::size_t>(node.link.joint)];
      SimulatedJoint::Config plant = plants.joints[static_cast<std::size_t>(node.link.joint)];
      // The transitions of CiA 402 take their own periods; the plant behind them needs no further time.
      plant.start_up_periods = 0;
      plant.homed = node.link.axis.absolute;
      plant.encoder_offset = -node.link.axis.offset;
      if (node.link.axis.mode == Cia402Mode::kCyclicTorque && !plant.mechanism)
        plant.mechanism =
            plain_mechanism(joint, machine.period_s, 1000 / std::abs(node.link.axis.torque_units));
      const MotorTruth& truth = motors[out.size() - 1][out.back().size()];
      plant.start += truth.start;
      plant.load = truth.load;
      EmulatedDrive::Config drive{plant, node.link.axis.counts_per_unit, machine.period_s,
                                  node.link.touch_input_bit};
      drive.units = emulated_units(node, joint);
      drive.torque_units = node.link.axis.torque_units;
      drive.habits = node.link.axis.habits;
      drive.offset_is_zero = node.offset_is_zero;
      drive.sto = node.link.sto;
      drive.inputs_on = truth.inputs_on;
      drive.switches_swapped = truth.switches_swapped;
      if (node.link.brake.fitted && node.link.brake.of_drive) drive.brake_bit = node.link.brake.output;
      drive.brake_inverted = node.link.brake.inverted;
      drive.switches = switches_of(node, joint, plant.index_distance, truth.switch_offset, table);
      EmulatedNode::Config emulated{node.link.id, node.dictionary, drive, sync_max, bus.fd};
      emulated.pdo_habits = node.pdo_habits;
      emulated.serial = truth.serial;
      emulated.without_id = truth.without_id;
      emulated.stores = truth.stores;
      emulated.bitrate = static_cast<int>(std::lround(bus.bitrate));
      out.back().push_back(std::make_unique<EmulatedNode>(emulated));
    }
  }
  return out;
}

class EmulatedCanDrives::Opener final : public CanOpener {
 public:
  explicit Opener(const EmulatedCanDrives& field) : field_(field) {}
  std::unique_ptr<CanEndpoint> open(const std::string& interface,
                                    const std::vector<CanFilter>& filters) override {
    for (std::size_t i = 0; i < field_.buses_.size(); ++i)
      if (field_.config_.buses[i].interface == interface) return field_.buses_[i]->open(filters);
    throw std::runtime_error("no virtual bus " + interface);
  }

 private:
  const EmulatedCanDrives& field_;
};

EmulatedCanDrives::EmulatedCanDrives(const Machine& machine, const ConfigTable& drives, const Machine& truth,
                                     const ConfigTable& true_drives)
    : config_(read_can_drives(machine, drives)),
      drives_(drives),
      nodes_(make_emulated_nodes(truth, read_can_drives(truth, true_drives), true_drives)),
      period_ns_(std::llround(machine.period_s * 1e9)),
      standing_(JointVec::Zero(static_cast<Eigen::Index>(machine.joints.size()))),
      probe_(machine, drives) {
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    buses_.push_back(std::make_unique<VirtualBus>(config_.buses[i].bitrate, config_.buses[i].data_bitrate));
    for (std::size_t k = 0; k < nodes_[i].size(); ++k) {
      buses_.back()->add(*nodes_[i][k]);
      const NodeLink::Config& link = config_.buses[i].nodes[k].link;
      probe_.wire(*nodes_[i][k], link.joint);
      int motors = 1;
      // A gantry stands at the mean of its motors, as the master has it.
      for (const Gantry::Config& gantry : config_.gantries)
        if (gantry.joint == link.joint) motors = gantry.motors;
      standing_[link.joint] += (nodes_[i][k]->drive().joint().measured() + link.axis.offset) / motors;
    }
  }
  master_ = std::make_unique<CanDrives>(config_, std::make_unique<Opener>(*this));
}

void EmulatedCanDrives::bring_up() {
  for (const ConfigTable& node : drives_.tables("node")) {
    const auto method = static_cast<int>(node.integer("homing_method", 5, kAnyNumber));
    if (node.boolean("absolute", false) || EmulatedHoming::knows(method)) continue;
    throw node.error(
        "homing_method",
        fmt::format("{} is the maker's own homing method, and no emulation of it exists; rehearse "
                    "with a method of CiA 402, as 35 or 37 (home is here), or absolute = true",
                    method));
  }
  master_->bring_up();
}

std::string EmulatedCanDrives::explain_fault(int joint) const {
  std::string text = master_->explain_fault(joint);
  for (std::size_t b = 0; !text.empty() && b < nodes_.size(); ++b)
    for (std::size_t i = 0; i < nodes_[b].size(); ++i) {
      const EmulatedDrive& drive = nodes_[b][i]->drive();
      if (joint >= 0 && config_.buses[b].nodes[i].link.joint != joint) continue;
      const Fault fault = master_->master(b).nodes()[i].fault();
      const std::string why = fault == Fault::kHomingFailed ? drive.why_not_homed() : "";
      if (!why.empty()) return fmt::format("{}; {}", text, why);
      if (joint >= 0 && drive.joint().on_limit_switch())
        text += fmt::format("; the emulated axis stands on a limit switch, where its method {} has led it",
                            config_.buses[b].nodes[i].homing_method);
    }
  return text;
}

void EmulatedCanDrives::exchange(const Setpoints& setpoints, Feedback& feedback) TRN_RT {
  master_->exchange(setpoints, feedback);
  // Before the first frame the master knows no position. The rehearsal shows where the axes really stand, as
  // the operator would see it.
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    for (const NodeLink& link : master_->master(i).nodes())
      if (!link.axis().measured_once()) feedback.q[link.config().joint] = standing_[link.config().joint];
  // Brakes on outputs of [io] are wired past the bus.
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    for (std::size_t k = 0; k < nodes_[i].size(); ++k) {
      const Brake::Config& brake = config_.buses[i].nodes[k].link.brake;
      if (!brake.fitted || brake.of_drive) continue;
      const bool on = feedback.held.on >> brake.output & 1;
      nodes_[i][k]->drive().joint().set_brake(on != brake.inverted);
    }
  // Behind the master's part: what it has sent in this period goes over the bus now, and is heard in the
  // next.
  for (auto& bus : buses_) bus->run_until(bus->now_ns() + period_ns_);
  probe_.step();
}

}  // namespace trn

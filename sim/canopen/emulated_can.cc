#include "sim/canopen/emulated_can.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/units.h"
#include "hal/can/bus.h"
#include "hal/can/can_node_config.h"
#include "hal/can/cia402.h"
#include "hal/can/node_link.h"
#include "sim/canopen/emulated_drive.h"
#include "sim/canopen/emulated_homing.h"
#include "sim/canopen/emulated_units.h"
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

// The switches lie so that the method of the config finds the home point where the config has it.
EmulatedHoming::Switches switches_of(const CanNodeConfig& node, const Joint& joint, double index_distance,
                                     const ConfigTable& emulation) {
  const bool rotary = joint.kind == JointKind::kRotary;
  const double unit = rotary ? kRadPerDeg : 1;
  const auto key = [&](std::string_view name) { return fmt::format("{}_{}", name, rotary ? "deg" : "mm"); };
  const double width = unit * emulation.number(key("home_switch_width"), 10.0, kPositive);
  const double pitch = unit * emulation.number(key("index_pitch"), 5.0, kPositive);
  EmulatedHoming::Switches out = EmulatedHoming::at_home(
      node.homing_method, node.link.axis.counts_per_unit < 0, node.home, index_distance, width);
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
      EmulatedDrive::Config drive{plant, node.link.axis.counts_per_unit, machine.period_s,
                                  node.link.touch_input_bit};
      drive.units = emulated_units(node, joint);
      drive.torque_units = node.link.axis.torque_units;
      drive.habits = node.link.axis.habits;
      drive.offset_is_zero = node.offset_is_zero;
      drive.switches = switches_of(node, joint, plant.index_distance, table);
      out.back().push_back(std::make_unique<EmulatedNode>(
          EmulatedNode::Config{node.link.id, node.dictionary, drive, sync_max, bus.fd}));
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

EmulatedCanDrives::EmulatedCanDrives(const Machine& machine, const ConfigTable& drives)
    : config_(read_can_drives(machine, drives)),
      nodes_(make_emulated_nodes(machine, config_, drives)),
      period_ns_(std::llround(machine.period_s * 1e9)),
      standing_(JointVec::Zero(static_cast<Eigen::Index>(machine.joints.size()))),
      probe_(machine, drives) {
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    buses_.push_back(std::make_unique<VirtualBus>(config_.buses[i].bitrate, config_.buses[i].data_bitrate));
    for (std::size_t k = 0; k < nodes_[i].size(); ++k) {
      buses_.back()->add(*nodes_[i][k]);
      const NodeLink::Config& link = config_.buses[i].nodes[k].link;
      probe_.wire(*nodes_[i][k], link.joint);
      standing_[link.joint] = nodes_[i][k]->drive().joint().measured() + link.axis.offset;
    }
  }
  master_ = std::make_unique<CanDrives>(config_, std::make_unique<Opener>(*this));
}

void EmulatedCanDrives::exchange(const Setpoints& setpoints, Feedback& feedback) TRN_RT {
  master_->exchange(setpoints, feedback);
  // Before the first frame the master knows no position. The rehearsal shows where the axes really stand, as
  // the operator would see it.
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    for (const NodeLink& link : master_->master(i).nodes())
      if (!link.axis().measured_once()) feedback.q[link.config().joint] = standing_[link.config().joint];
  // Behind the master's part: what it has sent in this period goes over the bus now, and is heard in the
  // next.
  for (auto& bus : buses_) bus->run_until(bus->now_ns() + period_ns_);
  probe_.step();
}

}  // namespace trn

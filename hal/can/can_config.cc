#include "hal/can/can_config.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "core/periods.h"
#include "hal/can/can_timing.h"
#include "hal/can/gantry_config.h"
#include "hal/can/pdo.h"

namespace trn {

namespace {

// Latched positions come in slow PDOs. After one turn of those, and some periods for the way there and back,
// they are all in.
constexpr int kTouchPeriods = kSlowPeriods + 5;

void add_item(BusBudget& budget, const std::string& what, int frames, int bytes, double cycle_s,
              bool fd = false) {
  if (frames > 0) budget.items.push_back({what, frames, bytes, cycle_s, fd});
}

void fill_budget(CanBusConfig& bus, const CanTiming& timing, int sync_bytes) {
  BusBudget& budget = bus.budget;
  budget.bus = bus.interface;
  budget.bitrate = bus.bitrate;
  budget.data_bitrate = bus.data_bitrate;
  budget.period_s = timing.period_s;
  // All that is sent cyclically. SDO transfers are not: of them only one frame at a time stands in the way
  // (`BusBudget::needed_s`).
  add_item(budget, "SYNC", 1, sync_bytes, timing.period_s);
  for (const CanNodeConfig& node : bus.nodes) {
    for (const Pdo& pdo : node.link.rpdos)
      add_item(budget, fmt::format("setpoints of node {}", node.link.id), 1, pdo.frame_size(),
               timing.period_s * pdo.every, pdo.fd);
    for (const Pdo& pdo : node.link.tpdos)
      add_item(budget, fmt::format("feedback of node {}", node.link.id), 1, pdo.frame_size(),
               timing.period_s * pdo.transmission, pdo.fd);
  }
  int beats = timing.heartbeat_ms > 0 ? 1 : 0, guarded = 0;
  for (const CanNodeConfig& node : bus.nodes) {
    beats += node.setup.wait_for_heartbeat;
    guarded += node.setup.guards;
  }
  add_item(budget, "heartbeats", beats, 1, 1e-3 * timing.heartbeat_ms);
  add_item(budget, "guarding", 2 * guarded, 1, 1e-3 * timing.guard_ms);
}

void check_budget(const CanBusConfig& bus, const ConfigTable& table) {
  if (bus.budget.fits()) return;
  throw table.error(
      "interface",
      fmt::format("bus {} at {:g} kbit/s cannot carry {} drives in a period of {:g} ms:\n{}\n"
                  "  the smallest period that would do: machine.period_s = {:g}; or share the drives "
                  "out over two buses{}",
                  bus.interface, bus.bitrate / 1000, bus.nodes.size(), 1000 * bus.budget.period_s,
                  bus.budget.arithmetic(), bus.budget.smallest_period_s(),
                  bus.fd ? "" : "; or CAN FD (fd = true), if drives and interface have it"));
}

CanBusConfig read_bus(const ConfigTable& table) {
  CanBusConfig bus;
  bus.interface = table.text("interface");
  constexpr std::size_t kNameMax = 15;  // of an interface, by the kernel
  if (bus.interface.empty() || bus.interface.size() > kNameMax ||
      bus.interface.find_first_of("/ :") != std::string::npos)
    throw table.error("interface",
                      fmt::format("'{}' is no name of a CAN interface; most are called can0", bus.interface));
  bus.bitrate = static_cast<double>(table.integer("bitrate", 1000000, Range{10000, 1000000}));
  bus.fd = table.boolean("fd", false);
  const auto data_bitrate =
      static_cast<double>(table.integer("data_bitrate", 2000000, Range{10000, 8000000}));
  if (bus.fd && data_bitrate < bus.bitrate)
    throw table.error("data_bitrate",
                      fmt::format("'data_bitrate' must not be less than bitrate ({:.0f})", bus.bitrate));
  if (bus.fd) bus.data_bitrate = data_bitrate;
  return bus;
}

// Asked for by itself: none of the node's other keys has been read yet, and no one of them is meant as `bus`.
std::string bus_of(const ConfigTable& node, std::size_t number, const std::vector<std::string>& names) {
  if (names.size() == 1) return node.choice("bus", names, names[0]);
  try {
    return node.choice("bus", names);
  } catch (const ConfigError& bad) {
    // A misspelt key is told as that; `eds`, which is as near and has not been read yet, is none.
    if (node.has("bus") || std::string_view(bad.what()).find(".eds'") == std::string_view::npos) throw;
  }
  throw node.error("bus",
                   fmt::format("missing key 'drives.node[{}].bus': there are {} buses, and this drive is "
                               "on one of them; legal: {}",
                               number, names.size(), fmt::join(names, ", ")));
}

void check_node(const CanDrivesConfig& config, const CanBusConfig& bus, const CanNodeConfig& node,
                bool gantry, const ConfigTable& table) {
  for (const CanNodeConfig& other : bus.nodes)
    if (other.link.id == node.link.id)
      throw table.error(
          "id", fmt::format("{} has node id {} already ({})", bus.interface, node.link.id, other.link.name));
  if (bus.nodes.size() == kNodesMax)
    throw table.error("bus",
                      fmt::format("{} has {} drives already, which is the most", bus.interface, kNodesMax));
  if (node.square != 0 && !gantry)
    throw table.error("joint", "only a motor of a [[drives.gantry]] can be out of square");
  if (gantry) return;
  for (const CanBusConfig& any : config.buses)
    for (const CanNodeConfig& other : any.nodes)
      if (other.link.joint == node.link.joint)
        throw table.error("joint", fmt::format("this joint has a drive already: {}; a joint with several "
                                               "motors needs a [[drives.gantry]]",
                                               other.link.name));
}

void check_every_joint(const Machine& machine, const CanDrivesConfig& config, const ConfigTable& drives) {
  for (std::size_t joint = 0; joint < machine.joints.size(); ++joint) {
    bool driven = false;
    for (const CanBusConfig& bus : config.buses)
      for (const CanNodeConfig& node : bus.nodes) driven |= node.link.joint == static_cast<int>(joint);
    if (!driven)
      throw drives.error("node", fmt::format("joint {} has no [[drives.node]]; every joint needs a drive",
                                             machine.joints[joint].name));
  }
}

}  // namespace

int CanDrivesConfig::joint_of(std::size_t bus, int id) const {
  for (const CanNodeConfig& node : buses[bus].nodes)
    if (node.link.id == id) return node.link.joint;
  return -1;
}

CanDrivesConfig read_can_drives(const Machine& machine, const ConfigTable& drives) {
  const CanTiming timing = read_can_timing(drives, machine.period_s);
  CanDrivesConfig config;
  config.period_s = machine.period_s;
  config.master_id = timing.master_id;
  config.sync_counter = timing.sync_counter;
  if (timing.touch) config.touch_periods = kTouchPeriods;
  config.overload_max = static_cast<std::uint32_t>(drives.integer("overload_max", 3, Range{1, 1000}));
  if (timing.heartbeat_ms > 0)
    config.heartbeat_periods = periods_of(1e-3 * timing.heartbeat_ms, machine.period_s);
  const std::vector<ConfigTable> buses = drives.tables("bus");
  std::vector<std::string> names;
  for (const ConfigTable& table : buses) {
    CanBusConfig bus = read_bus(table);
    if (std::find(names.begin(), names.end(), bus.interface) != names.end())
      throw table.error("interface", fmt::format("interface '{}' is there already", bus.interface));
    names.push_back(bus.interface);
    config.buses.push_back(std::move(bus));
  }
  const std::vector<ConfigTable> nodes = drives.tables("node");
  const std::vector<int> gantries = read_gantry_joints(machine, drives);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const ConfigTable& table = nodes[i];
    const std::string name = bus_of(table, i, names);
    CanBusConfig& bus =
        config.buses[static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin())];
    CanNodeConfig node = read_can_node(machine, timing, {bus.interface, bus.fd}, table);
    const bool gantry = std::find(gantries.begin(), gantries.end(), node.link.joint) != gantries.end();
    check_node(config, bus, node, gantry, table);
    bus.nodes.push_back(std::move(node));
  }
  for (std::size_t i = 0; i < buses.size(); ++i) {
    fill_budget(config.buses[i], timing, config.sync_counter > 0 ? 1 : 0);
    check_budget(config.buses[i], buses[i]);
  }
  check_every_joint(machine, config, drives);
  std::vector<CanNodeConfig*> all;
  for (CanBusConfig& bus : config.buses)
    for (CanNodeConfig& node : bus.nodes) all.push_back(&node);
  config.gantries = read_gantries(machine, drives, all);
  return config;
}

}  // namespace trn

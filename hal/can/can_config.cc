#include "hal/can/can_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>

#include "core/axes.h"
#include "core/units.h"
#include "hal/can/cia402.h"
#include "hal/can/cia402_axis.h"
#include "hal/can/pdo.h"
#include "hal/can/sdo.h"
#include "hal/can/setup_steps.h"

namespace trn {

namespace {

// Periods between PDOs that need not be fast; these are behind setpoints and feedback in priority.
constexpr int kSlowPeriods = 10;
// Latched positions come in slow PDOs. After one turn of those, and some periods for the way there and back,
// they are all in.
constexpr int kTouchPeriods = kSlowPeriods + 5;

struct Timing {
  int heartbeat_ms = 0, heartbeat_timeout_ms = 0, guard_ms = 0, missed_max = 0, master_id = 127;
  int sdo_timeout_ms = 0, boot_timeout_ms = 0, retries = 0;
  int sync_counter = 0;
  bool touch = false;            ///< the touch probe is on the drives' own inputs
  unsigned touch_input_bit = 0;  ///< of 0x60FD
  double enable_timeout_s = 0, homing_timeout_s = 0, period_s = 0;
};

Timing read_timing(const ConfigTable& drives, double period_s) {
  Timing t;
  t.period_s = period_s;
  t.master_id = static_cast<int>(drives.integer("master_id", 127, Range{1, kNodeIdMax}));
  t.heartbeat_ms = static_cast<int>(drives.integer("heartbeat_ms", 50, Range{0, 10000}));
  // Three heartbeats by default: one that is late behind other traffic is no loss of a drive.
  t.heartbeat_timeout_ms =
      static_cast<int>(drives.integer("heartbeat_timeout_ms", 3L * t.heartbeat_ms, Range{0, 30000}));
  if (t.heartbeat_ms > 0 && t.heartbeat_timeout_ms <= t.heartbeat_ms)
    throw drives.error(
        "heartbeat_timeout_ms",
        fmt::format("'heartbeat_timeout_ms' must be longer than heartbeat_ms ({})", t.heartbeat_ms));
  t.guard_ms = static_cast<int>(drives.integer("guarding_ms", 0, Range{0, 10000}));
  t.missed_max = static_cast<int>(drives.integer("missed_max", 3, Range{1, 100}));
  t.sdo_timeout_ms = static_cast<int>(drives.integer("sdo_timeout_ms", 500, Range{1, 60000}));
  t.boot_timeout_ms = static_cast<int>(drives.integer("boot_timeout_ms", 3000, Range{10, 600000}));
  t.retries = static_cast<int>(drives.integer("sdo_retries", 1, Range{0, 10}));
  t.enable_timeout_s = drives.number("enable_timeout_s", 2.0, kPositive);
  t.homing_timeout_s = drives.number("homing_timeout_s", 120.0, kPositive);
  t.sync_counter = static_cast<int>(drives.integer("sync_counter", 0, Range{0, 240}));
  if (t.sync_counter == 1)
    throw drives.error("sync_counter", "'sync_counter' is 0, or 2 to 240 (CiA 301, 7.5.2.22)");
  t.touch = drives.choice("probe", {"none", "drive"}, "none") == "drive";
  t.touch_input_bit = static_cast<unsigned>(drives.integer("probe_input_bit", 16, Range{0, 31}));
  return t;
}

std::uint32_t periods(double duration_s, double period_s) {
  // The 1e-9 keeps 0.05 / 0.001, which is 50 and a rounding error, from becoming 51.
  return static_cast<std::uint32_t>(std::ceil(duration_s / period_s - 1e-9));
}

Cia402Mode read_mode(const ConfigTable& node) {
  static const std::vector<std::string> kNames = {"csp", "csv", "ip", "pp"};
  const std::string name = node.choice("mode", kNames, "csp");
  if (name == "csv") return Cia402Mode::kCyclicVelocity;
  if (name == "ip") return Cia402Mode::kInterpolatedPosition;
  return name == "pp" ? Cia402Mode::kProfilePosition : Cia402Mode::kCyclicPosition;
}

/// Reads one [[drives.node]].
class NodeReader {
 public:
  NodeReader(const Machine& machine, const Timing& timing, const ConfigTable& table)
      : machine_(machine), timing_(timing), table_(table) {}

  CanNodeConfig read(const CanBusConfig& bus) {
    CanNodeConfig node;
    read_joint(node);
    node.link.name = fmt::format("{} node {} (joint {})", bus.interface, node.link.id, joint().name);
    read_axis(node);
    read_dictionary(node);
    // The PDOs before the steps: the steps write their mapping.
    plan(node, bus.fd);
    DriveSetup setup = read_setup(node);
    node.setup.id = node.link.id;
    node.setup.name = node.link.name;
    node.setup.steps = setup_steps(setup, node.dictionary, node.link.rpdos, node.link.tpdos);
    // What the config writes comes last, so that it has the last word over the data sheet and over what the
    // master sets by itself.
    for (const SetupStep& step : read_writes(node)) node.setup.steps.push_back(step);
    node.setup.signature = signature_step(setup);
    node.setup.wait_for_heartbeat = timing_.heartbeat_ms > 0;
    node.setup.sdo_timeout_ns = 1'000'000LL * timing_.sdo_timeout_ms;
    node.setup.boot_timeout_ns = 1'000'000LL * timing_.boot_timeout_ms;
    node.setup.retries = timing_.retries;
    return node;
  }

 private:
  const Joint& joint() const { return machine_.joints[joint_]; }
  double unit() const { return joint().kind == JointKind::kRotary ? kRadPerDeg : 1; }
  std::string key(std::string_view stem, std::string_view rest = "") const {
    return fmt::format("{}_{}{}", stem, joint().kind == JointKind::kRotary ? "deg" : "mm", rest);
  }

  void read_joint(CanNodeConfig& node) {
    std::vector<std::string> names;
    for (const Joint& candidate : machine_.joints) names.push_back(candidate.name);
    const std::string name = table_.choice("joint", names);
    joint_ = static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
    node.link.joint = static_cast<int>(joint_);
    node.link.id = static_cast<int>(table_.integer("id", Range{1, kNodeIdMax}));
    if (node.link.id == timing_.master_id)
      throw table_.error("id",
                         fmt::format("node id {} is the master's own (drives.master_id)", node.link.id));
  }

  void read_axis(CanNodeConfig& node) {
    Cia402Axis::Config& axis = node.link.axis;
    axis.mode = read_mode(table_);
    const double counts = table_.number(key("counts_per"), kPositive) / unit();
    axis.counts_per_unit = table_.boolean("reverse", false) ? -counts : counts;
    check_counts(axis.counts_per_unit);
    axis.absolute = table_.boolean("absolute", false);
    axis.gain_1_s = table_.number("velocity_gain_1_s", 20.0, kPositive);
    axis.following_error_max = unit() * table_.number(key("following_error"), 0.0, kNotNegative);
    // Three periods at the joint's full speed, and ten counts for an encoder that is coarse: more in one
    // period cannot be a motion.
    axis.step_max = 3 * joint().limit.velocity * timing_.period_s + 10 / counts;
    axis.enable_periods_max = periods(timing_.enable_timeout_s, timing_.period_s);
    axis.homing_periods_max = periods(timing_.homing_timeout_s, timing_.period_s);
    NodeWatchConfig& watch = node.link.watch;
    watch.missed_max = static_cast<std::uint32_t>(timing_.missed_max);
    if (timing_.heartbeat_ms > 0)
      watch.heartbeat_periods = periods(1e-3 * timing_.heartbeat_timeout_ms, timing_.period_s);
    if (timing_.guard_ms > 0) watch.guard_periods = periods(1e-3 * timing_.guard_ms, timing_.period_s);
  }

  // A position is a signed 32-bit number of counts.
  void check_counts(double counts) const {
    const JointLimit& limit = joint().limit;
    const double most = std::max(std::abs(limit.min), std::abs(limit.max)) * std::abs(counts);
    if (most < 2147483647.0) return;
    throw table_.error(
        key("counts_per"),
        fmt::format("joint {} would reach {:.3g} counts, 32 bits hold 2147483647; use a coarser unit "
                    "in the drive or a smaller range",
                    joint().name, most));
  }

  void read_dictionary(CanNodeConfig& node) {
    const std::string name = table_.text("eds");
    const std::filesystem::path beside = std::filesystem::path(machine_.root.file()).parent_path() / name;
    try {
      node.dictionary = load_eds(beside.string(), node.link.id);
    } catch (const EdsError& error) {
      throw table_.error("eds", error.what());
    }
    const int of = node.dictionary.node_id.value_or(node.link.id);
    if (of != node.link.id)
      throw table_.error("eds",
                         fmt::format("this DCF is of node {}, the drive here is node {}", of, node.link.id));
  }

  void plan(CanNodeConfig& node, bool fd) {
    // In the order of urgency: control and status word with the positions fill the first PDO, which goes
    // every period. What does not fit there, such as the mode, goes into slow ones.
    std::vector<ObjectKey> out = {{0x6040, 0}}, in = {{0x6041, 0}, {0x6064, 0}};
    if (timing_.touch) in.push_back({0x60B9, 0});
    in.push_back({0x6061, 0});
    const Cia402Mode mode = node.link.axis.mode;
    if (mode == Cia402Mode::kCyclicVelocity)
      out.push_back({0x60FF, 0});
    else if (mode == Cia402Mode::kInterpolatedPosition)
      out.push_back({0x60C1, 1});
    else
      out.push_back({0x607A, 0});
    if (timing_.touch) out.push_back({0x60B8, 0});
    out.push_back({0x6060, 0});
    if (timing_.touch) in.insert(in.end(), {{0x60BA, 0}, {0x60BB, 0}});
    node.link.limit_switches = table_.boolean("limit_switches", false);
    node.link.touch_input_bit = timing_.touch_input_bit;
    if (timing_.touch || node.link.limit_switches) in.push_back({0x60FD, 0});
    try {
      node.link.rpdos = plan_pdos(node.dictionary, out, true, node.link.id, fd);
      node.link.tpdos = plan_pdos(node.dictionary, in, false, node.link.id, fd);
    } catch (const EdsError& error) {
      throw table_.error("eds", error.what());
    }
    // A TPDO sends itself with every tenth SYNC (transmission type 10). For an RPDO the type says when the
    // drive takes it over, so there the master sends more seldom.
    for (std::size_t i = 1; i < node.link.tpdos.size(); ++i) node.link.tpdos[i].transmission = kSlowPeriods;
    for (std::size_t i = 1; i < node.link.rpdos.size(); ++i) node.link.rpdos[i].every = kSlowPeriods;
  }

  DriveSetup read_setup(CanNodeConfig& node) {
    const JointLimit& limit = joint().limit;
    DriveSetup setup;
    setup.name = node.link.name;
    setup.period_s = timing_.period_s;
    setup.mode = node.link.axis.mode;
    setup.master_id = timing_.master_id;
    setup.heartbeat_ms = timing_.heartbeat_ms;
    setup.heartbeat_timeout_ms = timing_.heartbeat_timeout_ms;
    setup.sync_counter = timing_.sync_counter;
    const double scale = node.link.axis.counts_per_unit;
    // Zero if the joint reaches it, else the end of its range next to zero.
    const double home = std::clamp(0.0, limit.min, limit.max);
    node.home =
        unit() * table_.number(key("home"), home / unit(), Range{limit.min / unit(), limit.max / unit()});
    node.homing_method = static_cast<int>(table_.integer("homing_method", 5, Range{-128, 37}));
    setup.homes = !node.link.axis.absolute;
    setup.homing_method = node.homing_method;
    if (std::abs(node.home * scale) > std::numeric_limits<std::int32_t>::max())
      throw table_.error(key("home"), "the home point is beyond the 32 bits of a drive's counts");
    setup.home_counts = static_cast<std::int64_t>(std::nearbyint(node.home * scale));
    const double rotary_factor = joint().kind == JointKind::kRotary ? 2 : 1;  // 20 mm/s, 10 deg/s
    const double search = unit() * table_.number(key("homing_speed", "_s"), 20.0 / rotary_factor, kPositive);
    const double slow = unit() * table_.number(key("index_speed", "_s"), 2.0 / rotary_factor, kPositive);
    const auto magnitude = [&](double value) {
      constexpr double kMost = std::numeric_limits<std::uint32_t>::max();  // all these objects are UNSIGNED32
      return static_cast<std::int64_t>(std::min(std::abs(value * scale), kMost));
    };
    setup.search_counts_s = magnitude(std::min(search, limit.velocity));
    setup.index_counts_s = magnitude(std::min(slow, limit.velocity));
    setup.acceleration_counts_s2 = magnitude(limit.acceleration);
    setup.velocity_counts_s = magnitude(limit.velocity);
    // A quick stop brakes harder than any plan, since it need not keep the work.
    const double quick = table_.number("quick_stop_factor", 2.0, kPositive);
    setup.quick_stop_counts_s2 = magnitude(quick * limit.acceleration);
    setup.vendor = table_.integer("vendor", 0, Range{0, 4294967295.0});
    setup.product = table_.integer("product", 0, Range{0, 4294967295.0});
    return setup;
  }

  std::vector<SetupStep> read_writes(const CanNodeConfig& node) const {
    std::vector<SetupStep> steps;
    for (const ConfigTable& write : table_.tables_if("write")) {
      SetupStep step;
      step.key = {static_cast<std::uint16_t>(write.integer("index", Range{0x1000, 0xFFFF})),
                  static_cast<std::uint8_t>(write.integer("sub", 0, Range{0, 255}))};
      const DictionaryEntry* entry = node.dictionary.find(step.key);
      if (!entry || !entry->writable)
        throw write.error("index",
                          fmt::format("object {} {} in {}", to_string(step.key),
                                      entry ? "cannot be written" : "does not exist", node.dictionary.file));
      const long value = write.integer("value");
      step.bytes = encode_integer(entry->type, value);
      if (step.bytes.empty())
        throw write.error("value", fmt::format("{} does not fit into object {} ({} bits)", value,
                                               to_string(step.key), bits_of(entry->type)));
      step.what = entry->name;
      step.remedy = "see [[drives.node.write]] in the config";
      steps.push_back(step);
    }
    return steps;
  }

  const Machine& machine_;
  const Timing& timing_;
  const ConfigTable& table_;
  std::size_t joint_ = 0;
};

void add_item(BusBudget& budget, const std::string& what, int frames, int bytes, double cycle_s,
              bool fd = false) {
  if (frames > 0) budget.items.push_back({what, frames, bytes, cycle_s, fd});
}

void fill_budget(CanBusConfig& bus, const Timing& timing, int sync_bytes) {
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
  if (timing.heartbeat_ms > 0)
    add_item(budget, "heartbeats", static_cast<int>(bus.nodes.size()) + 1, 1, 1e-3 * timing.heartbeat_ms);
  if (timing.guard_ms > 0)
    add_item(budget, "guarding", 2 * static_cast<int>(bus.nodes.size()), 1, 1e-3 * timing.guard_ms);
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
  bus.bitrate = static_cast<double>(table.integer("bitrate", 1000000, Range{10000, 1000000}));
  bus.fd = table.boolean("fd", false);
  const auto data_bitrate =
      static_cast<double>(table.integer("data_bitrate", 2000000, Range{10000, 8000000}));
  if (bus.fd && data_bitrate < bus.bitrate)
    throw table.error("data_bitrate",
                      fmt::format("'data_bitrate' must not be less than bitrate ({:g})", bus.bitrate));
  if (bus.fd) bus.data_bitrate = data_bitrate;
  return bus;
}

void check_node(const CanDrivesConfig& config, const CanBusConfig& bus, const CanNodeConfig& node,
                const ConfigTable& table) {
  for (const CanNodeConfig& other : bus.nodes)
    if (other.link.id == node.link.id)
      throw table.error(
          "id", fmt::format("{} has node id {} already ({})", bus.interface, node.link.id, other.link.name));
  for (const CanBusConfig& any : config.buses)
    for (const CanNodeConfig& other : any.nodes)
      if (other.link.joint == node.link.joint)
        throw table.error("joint", fmt::format("this joint has a drive already: {}", other.link.name));
}

}  // namespace

int CanDrivesConfig::joint_of(std::size_t bus, int id) const {
  for (const CanNodeConfig& node : buses[bus].nodes)
    if (node.link.id == id) return node.link.joint;
  return -1;
}

CanDrivesConfig read_can_drives(const Machine& machine, const ConfigTable& drives) {
  const Timing timing = read_timing(drives, machine.period_s);
  CanDrivesConfig config;
  config.period_s = machine.period_s;
  config.master_id = timing.master_id;
  config.sync_counter = timing.sync_counter;
  if (timing.touch) config.touch_periods = kTouchPeriods;
  config.overload_max = static_cast<std::uint32_t>(drives.integer("overload_max", 3, Range{1, 1000}));
  if (timing.heartbeat_ms > 0)
    config.heartbeat_periods = periods(1e-3 * timing.heartbeat_ms, machine.period_s);
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
  for (const ConfigTable& table : nodes) {
    const std::string name =
        names.size() == 1 ? table.choice("bus", names, names[0]) : table.choice("bus", names);
    CanBusConfig& bus =
        config.buses[static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin())];
    CanNodeConfig node = NodeReader(machine, timing, table).read(bus);
    check_node(config, bus, node, table);
    bus.nodes.push_back(std::move(node));
  }
  for (std::size_t i = 0; i < buses.size(); ++i) {
    fill_budget(config.buses[i], timing, config.sync_counter > 0 ? 1 : 0);
    check_budget(config.buses[i], buses[i]);
  }
  if (nodes.size() != machine.joints.size())
    throw drives.error("node", fmt::format("{} joints need as many drives; there are {} [[drives.node]]",
                                           machine.joints.size(), nodes.size()));
  return config;
}

}  // namespace trn

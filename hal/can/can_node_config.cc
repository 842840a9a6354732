#include "hal/can/can_node_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/axes.h"
#include "core/joint_model.h"
#include "core/joint_range.h"
#include "core/letter_case.h"
#include "core/periods.h"
#include "core/units.h"
#include "hal/can/cia402.h"
#include "hal/can/cia402_axis.h"
#include "hal/can/drive_units.h"
#include "hal/can/feed_forward_config.h"
#include "hal/can/nmt.h"
#include "hal/can/node_safety_config.h"
#include "hal/can/pdo.h"
#include "hal/can/sdo.h"
#include "hal/can/setup_steps.h"

namespace trn {

namespace {

Cia402Mode read_mode(const ConfigTable& node) {
  static const std::vector<std::string> kNames = {"csp", "csv", "cst", "ip", "pp"};
  const std::string name = node.choice("mode", kNames, "csp");
  if (name == "csv") return Cia402Mode::kCyclicVelocity;
  if (name == "cst") return Cia402Mode::kCyclicTorque;
  if (name == "ip") return Cia402Mode::kInterpolatedPosition;
  return name == "pp" ? Cia402Mode::kProfilePosition : Cia402Mode::kCyclicPosition;
}

constexpr ObjectKey kTorqueActual{0x6077, 0};

bool carries(const Pdo& pdo, const std::vector<ObjectKey>& objects) {
  return std::any_of(pdo.fields.begin(), pdo.fields.end(), [&](const PdoField& field) {
    return std::find(objects.begin(), objects.end(), field.key) != objects.end();
  });
}

/// Reads one [[drives.node]].
class NodeReader {
 public:
  NodeReader(const Machine& machine, const CanTiming& timing, const ConfigTable& table)
      : machine_(machine), timing_(timing), table_(table) {}

  CanNodeConfig read(const NodeBus& bus) {
    CanNodeConfig node;
    read_joint(node);
    node.link.name = fmt::format("{} node {} (joint {})", bus.interface, node.link.id, joint().name);
    read_axis(node);
    read_dictionary(node);
    read_habits(node);
    read_node_safety(machine_, table_, node.link);
    // The PDOs before the steps: the steps write their mapping.
    plan(node, bus.fd);
    const DriveSetup setup = read_setup(node);
    node.setup.id = node.link.id;
    node.setup.name = node.link.name;
    node.setup.steps = setup_steps(setup, node.dictionary, node.link.rpdos, node.link.tpdos);
    // What the config writes comes last, so that it has the last word over the data sheet and over what the
    // master sets by itself.
    for (const SetupStep& step : read_writes(node)) node.setup.steps.push_back(step);
    node.setup.signature = signature_step(node.setup.steps, node.dictionary);
    node.setup.wait_for_heartbeat = setup.heartbeat_ms > 0;
    node.setup.guards = setup.guard_ms > 0;
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
    axis.period_s = timing_.period_s;
    const double counts = table_.number(key("counts_per"), kPositive) / unit();
    axis.counts_per_unit = table_.boolean("reverse", false) ? -counts : counts;
    axis.absolute = table_.boolean("absolute", false);
    axis.offset = unit() * table_.number(key("encoder_offset"), 0.0, kAnyNumber);
    if (axis.offset != 0 && !axis.absolute)
      throw table_.error(key("encoder_offset"),
                         "an offset is of an absolute encoder; a joint that homes has its home position");
    axis.endless = joint().endless;
    if (!axis.endless) check_counts(axis.counts_per_unit, axis.offset);
    axis.gain_1_s = table_.number("velocity_gain_1_s", 20.0, kPositive);
    axis.following_error_max = unit() * table_.number(key("following_error"), 0.0, kNotNegative);
    // Three periods at the joint's full speed, and ten counts for an encoder that is coarse: more in one
    // period cannot be a motion.
    axis.step_max = 3 * joint().limit.velocity * timing_.period_s + 10 / counts;
    axis.enable_periods_max = periods_of(timing_.enable_timeout_s, timing_.period_s);
    axis.homing_periods_max = periods_of(timing_.homing_timeout_s, timing_.period_s);
  }

  static bool takes(const CanNodeConfig& node, ObjectKey key) {
    const DictionaryEntry* entry = node.dictionary.find(key);
    return entry && entry->writable;
  }
  static std::string limits_text(const CanNodeConfig& node, ObjectKey key) {
    const DictionaryEntry* entry = node.dictionary.find(key);
    if (!entry || (!entry->low && !entry->high)) return to_string(key) + " has no limits";
    const auto text = [](const std::optional<std::int64_t>& value) {
      return value ? fmt::format("{}", *value) : "any";
    };
    return fmt::format("{} is {} to {}", to_string(key), text(entry->low), text(entry->high));
  }

  void check_skipped(const ObjectDictionary& dictionary, std::uint16_t index, std::optional<unsigned> sub,
                     const std::string& name) const {
    if (index == 0x6040)
      throw table_.error("skip", "0x6040 is the controlword: it is sent every period and cannot be left out");
    const bool there = std::any_of(
        dictionary.entries.begin(), dictionary.entries.end(),
        [&](const auto& entry) { return entry.first.index == index && (!sub || entry.first.sub == *sub); });
    if (!there)
      throw table_.error("skip",
                         fmt::format("the drive's data sheet has no {}, so it is never written; is it "
                                     "another object?",
                                     name));
  }

  // "0x6085" or "0x60C2:2", in the spelling in which they are compared later
  std::vector<std::string> read_skip(const ObjectDictionary& dictionary) const {
    std::vector<std::string> out;
    for (const std::string& text : table_.texts("skip", {})) {
      ObjectKey key;
      unsigned sub = 0;
      int read = 0;
      const bool whole = std::sscanf(text.c_str(), "0x%4hx%n", &key.index, &read) == 1;
      const bool with_sub = whole && std::sscanf(text.c_str() + read, ":%3u%n", &sub, &read) == 1;
      const std::string index = fmt::format("0x{:04X}", key.index);
      out.push_back(with_sub ? fmt::format("{}:{}", index, sub) : index);
      if (!whole || sub > 255 || lower_case(out.back()) != lower_case(text))
        throw table_.error("skip", fmt::format("'{}' is no object; legal: \"0x6085\", \"0x60C2:2\"", text));
      check_skipped(dictionary, key.index, with_sub ? std::optional(sub) : std::nullopt, out.back());
    }
    return out;
  }

  // Heartbeats both ways, or guarding both ways: a node may not do both (CiA 301, 7.2.8.2).
  void read_watch(CanNodeConfig& node, DriveSetup& setup) const {
    const bool beats = timing_.heartbeat_ms > 0 && takes(node, {0x1017, 0});
    const bool hears = timing_.heartbeat_ms > 0 && takes(node, {0x1016, 1});
    const bool guards =
        timing_.guard_ms > 0 && takes(node, {0x100C, 0}) && takes(node, {0x100D, 0}) && !(beats && hears);
    NodeWatchConfig& watch = node.link.watch;
    watch.missed_max = static_cast<std::uint32_t>(timing_.missed_max);
    setup.master_id = timing_.master_id;
    if (guards) {
      setup.guard_ms = timing_.guard_ms;
      setup.life_time_factor = timing_.life_time_factor;
      watch.guard_periods = periods_of(1e-3 * timing_.guard_ms, timing_.period_s);
      watch.heartbeat_periods =
          periods_of(1e-3 * timing_.guard_ms * timing_.life_time_factor, timing_.period_s);
      return;
    }
    if (hears) setup.heartbeat_timeout_ms = timing_.heartbeat_timeout_ms;
    if (!beats) return;
    setup.heartbeat_ms = timing_.heartbeat_ms;
    watch.heartbeat_periods = periods_of(1e-3 * timing_.heartbeat_timeout_ms, timing_.period_s);
  }

  std::optional<InterpolationTime> read_interpolation(const CanNodeConfig& node,
                                                      const DriveSetup& setup) const {
    if (!takes(node, {0x60C2, 1}) || node.link.axis.mode == Cia402Mode::kProfilePosition) {
      if (table_.has("interpolation_period")) table_.numbers("interpolation_period");
      return std::nullopt;
    }
    if (!table_.has("interpolation_period")) {
      const auto time = interpolation_time(timing_.period_s, node.dictionary);
      const bool skipped = std::any_of(setup.skip.begin(), setup.skip.end(),
                                       [](const std::string& name) { return name.substr(0, 6) == "0x60C2"; });
      if (time || skipped) return time;
      throw table_.error("eds", fmt::format("by its data sheet the drive cannot interpolate over "
                                            "machine.period_s = {:g}: {}",
                                            timing_.period_s, limits_text(node, {0x60C2, 1})));
    }
    const std::vector<double> given = table_.numbers("interpolation_period");
    const bool legal = given.size() == 2 && given[0] >= 1 && given[0] <= 255 && given[1] >= -128 &&
                       given[1] <= 127 && given[0] == std::floor(given[0]) &&
                       given[1] == std::floor(given[1]);
    if (!legal || std::abs(given[0] * std::pow(10.0, given[1]) - timing_.period_s) > 1e-6 * timing_.period_s)
      throw table_.error("interpolation_period",
                         fmt::format("'interpolation_period' is [value, exponent], value 1 to 255, and value "
                                     "times ten to the exponent must be machine.period_s = {:g}",
                                     timing_.period_s));
    return InterpolationTime{static_cast<int>(given[0]), static_cast<int>(given[1])};
  }

  // A position is a signed 32-bit number of counts.
  void check_counts(double counts, double offset) const {
    const JointLimit& limit = joint().limit;
    const double most =
        std::max(std::abs(limit.min - offset), std::abs(limit.max - offset)) * std::abs(counts);
    if (most < 2147483647.0) return;
    throw table_.error(
        key("counts_per"),
        fmt::format("joint {} would reach {:.3g} counts, 32 bits hold 2147483647; use a coarser unit "
                    "in the drive or a smaller range",
                    joint().name, most));
  }

  void read_dictionary(CanNodeConfig& node) {
    const std::string name = table_.text("eds");
    if (name.empty()) throw table_.error("eds", "'eds' is empty; it names the drive's EDS or DCF file");
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

  // Each write once; the objects between clear and count, and only then on.
  static bool is_legal(const PdoOrder& order) {
    const auto at = [&](PdoWrite write) {
      return std::find(order.begin(), order.end(), write) - order.begin();
    };
    using W = PdoWrite;
    const bool each = std::is_permutation(order.begin(), order.end(), PdoHabits{}.order.begin());
    return each && at(W::kOff) < at(W::kMap) && at(W::kClear) < at(W::kMap) && at(W::kMap) < at(W::kCount) &&
           at(W::kCount) < at(W::kOn);
  }

  static PdoHabits read_pdo_habits(const ConfigTable& table) {
    PdoHabits habits;
    if (table.has("pdo_order")) {
      const std::vector<std::string> words = table.texts("pdo_order", {});
      habits.strict = true;
      bool known = words.size() == habits.order.size();
      for (std::size_t i = 0; known && i < words.size(); ++i) {
        int write = 0;
        while (write < kPdoWrites && to_string(static_cast<PdoWrite>(write)) != words[i]) ++write;
        known = write < kPdoWrites;
        if (known) habits.order[i] = static_cast<PdoWrite>(write);
      }
      if (!known || !is_legal(habits.order))
        throw table.error(
            "pdo_order",
            "'pdo_order' has \"off\", \"type\", \"clear\", \"map\", \"count\", \"on\" once each; off and "
            "clear before map, then count, then on");
    }
    for (const std::string& name : table.texts("fixed_pdos", {})) {
      const bool shaped = name.size() == 5 && (name[0] == 'R' || name[0] == 'T') &&
                          name.substr(1, 3) == "PDO" && name[4] >= '1' && name[4] <= '4';
      if (!shaped)
        throw table.error("fixed_pdos",
                          fmt::format("'{}' is no PDO; legal: RPDO1 to RPDO4, TPDO1 to TPDO4", name));
      (name[0] == 'R' ? habits.fixed_rpdos : habits.fixed_tpdos) |= 1u << (name[4] - '1');
    }
    return habits;
  }

  void read_habits(CanNodeConfig& node) {
    DriveHabits& habits = node.link.axis.habits;
    if (const auto table = table_.table_if("habits")) {
      habits.mode_display = table->boolean("mode_display", true);
      habits.follows_bit = table->boolean("follows_bit", true);
      habits.homing_reached = table->boolean("homing_reached", true);
      habits.stands_to_switch = table->boolean("stands_to_switch", false);
      node.pdo_habits = read_pdo_habits(*table);
      node.offset_is_zero = table->choice("home_offset", {"position", "zero"}, "position") == "zero";
    }
    const DictionaryEntry* display = node.dictionary.find({0x6061, 0});
    habits.mode_display = habits.mode_display && display && display->readable;
    node.link.mode_by_sdo = !by_pdo(node, {0x6060, 0}, true);
    node.link.display_by_sdo = habits.mode_display && !by_pdo(node, {0x6061, 0}, false);
    node.link.has_error_code = node.dictionary.find({0x603F, 0}) != nullptr;
  }

  // What the data sheet lets go in PDOs; without an object there is nothing to map.
  bool by_pdo(const CanNodeConfig& node, ObjectKey key, bool receive) const {
    const DictionaryEntry* entry = node.dictionary.find(key);
    if (key.index == 0x6061 && !node.link.axis.habits.mode_display) return false;
    return entry && entry->mappable && (receive ? entry->writable : entry->readable);
  }

  void plan(CanNodeConfig& node, bool fd) {
    // In the order of urgency: control and status word with the positions fill the first PDO, which goes
    // every period. What does not fit there, such as the mode, goes into slow ones.
    std::vector<ObjectKey> out = {{0x6040, 0}}, in = {{0x6041, 0}, {0x6064, 0}};
    if (timing_.touch) in.push_back({0x60B9, 0});
    const bool torque = table_.boolean("torque", false);
    if (torque) in.push_back(kTorqueActual);
    if (node.link.reads_inputs) in.push_back({0x60FD, 0});
    if (by_pdo(node, {0x6061, 0}, false)) in.push_back({0x6061, 0});
    const Cia402Mode mode = node.link.axis.mode;
    if (mode == Cia402Mode::kCyclicVelocity)
      out.push_back({0x60FF, 0});
    else if (mode == Cia402Mode::kCyclicTorque)
      out.push_back({0x6071, 0});
    else if (mode == Cia402Mode::kInterpolatedPosition)
      out.push_back({0x60C1, 1});
    else
      out.push_back({0x607A, 0});
    const auto [offsets, missing] = feed_forward_objects(node.dictionary, node.link.axis.mode,
                                                         node.link.joint, read_feed_forward(machine_));
    for (const ObjectKey object : missing)
      node.warnings.push_back(
          fmt::format("{}: {} does not let {} be mapped; the drive goes without this "
                      "feed-forward",
                      node.link.name, node.dictionary.file, to_string(object)));
    out.insert(out.end(), offsets.begin(), offsets.end());
    const bool brake = node.link.brake.fitted && node.link.brake.of_drive;
    if (brake || node.link.output_mask != 0) out.push_back({0x60FE, 1});
    if (timing_.touch) out.push_back({0x60B8, 0});
    if (by_pdo(node, {0x6060, 0}, true)) out.push_back({0x6060, 0});
    if (timing_.touch) in.insert(in.end(), {{0x60BA, 0}, {0x60BB, 0}});
    node.link.limit_switches = table_.boolean("limit_switches", false);
    node.link.touch_input_bit = timing_.touch_input_bit;
    if ((timing_.touch || node.link.limit_switches) && !node.link.reads_inputs) in.push_back({0x60FD, 0});
    try {
      node.link.rpdos = plan_pdos(node.dictionary, out, true, node.link.id, fd, node.pdo_habits);
      node.link.tpdos = plan_pdos(node.dictionary, in, false, node.link.id, fd, node.pdo_habits);
    } catch (const EdsError& error) {
      throw table_.error("eds", error.what());
    }
    // A TPDO sends itself with every tenth SYNC (transmission type 10). For an RPDO the type says when the
    // drive takes it over, so there the master sends more seldom.
    const std::vector<ObjectKey> fast_in = {{0x6041, 0}, {0x6064, 0}, {0x60B9, 0}, kTorqueActual};
    for (Pdo& pdo : node.link.tpdos) pdo.transmission = carries(pdo, fast_in) ? 1 : kSlowPeriods;
    // What goes with every setpoint has a PDO in every period.
    std::vector<ObjectKey> fast_out = {{0x6040, 0}, {0x607A, 0}, {0x60FF, 0}, {0x6071, 0}, {0x60C1, 1}};
    fast_out.insert(fast_out.end(), offsets.begin(), offsets.end());
    for (Pdo& pdo : node.link.rpdos) pdo.every = carries(pdo, fast_out) ? 1 : kSlowPeriods;
    // What safety hangs on goes with every SYNC as well.
    int pdo = 0;
    PdoField field;
    if (node.link.reads_inputs && find_field(node.link.tpdos, {0x60FD, 0}, pdo, field))
      node.link.tpdos[static_cast<std::size_t>(pdo)].transmission = 1;
    if (brake && find_field(node.link.rpdos, {0x60FE, 1}, pdo, field))
      node.link.rpdos[static_cast<std::size_t>(pdo)].every = 1;
  }

  void read_limits(const CanNodeConfig& node, DriveSetup& setup) const {
    const JointLimit& limit = joint().limit;
    const Cia402Axis::Config& axis = node.link.axis;
    const auto counts = [&](double q) { return std::llround((q - axis.offset) * axis.counts_per_unit); };
    setup.sets_limits = table_.choice("drive_limits", {"check", "set"}, "check") == "set";
    setup.endless = joint().endless;
    if (setup.endless && setup.sets_limits)
      throw table_.error("drive_limits", "a joint that turns without an end has no range to be set");
    setup.range_low = std::min(counts(limit.min), counts(limit.max));
    setup.range_high = std::max(counts(limit.min), counts(limit.max));
    setup.following_counts = std::llround(axis.following_error_max * std::abs(axis.counts_per_unit));
    if (table_.has("following_error_ms")) {
      setup.following_ms = static_cast<int>(table_.integer("following_error_ms", Range{0, 65535}));
      needs_object(node, "following_error_ms", {0x6066, 0}, *setup.following_ms, setup.sets_limits);
      if (setup.following_counts == 0)
        throw table_.error(
            "following_error_ms",
            fmt::format("a time needs an error that it belongs to: set '{}'", key("following_error")));
    }
    const double turn = node.units.counts_per_motor_turn;
    if (turn > 0) setup.motor_rpm = std::llround(60 * limit.velocity * std::abs(axis.counts_per_unit) / turn);
  }

  // A key of an object that the drive must have, and take this value.
  void needs_object(const CanNodeConfig& node, std::string_view name, ObjectKey object, std::int64_t value,
                    bool written = true) const {
    const DictionaryEntry* entry = node.dictionary.find(object);
    if (!entry || bits_of(entry->type) == 0 || (written ? !entry->writable : !entry->readable))
      throw table_.error(
          name, fmt::format("{} {} {} in {}; leave '{}' out", node.link.name, to_string(object),
                            entry ? "cannot be written" : "does not exist", node.dictionary.file, name));
    const bool low = entry->low && value < *entry->low, high = entry->high && value > *entry->high;
    if (written && (low || high || encode_integer(entry->type, value).empty()))
      throw table_.error(
          name, fmt::format("{} does not take {} in {}: by {} {}", node.link.name, value, to_string(object),
                            node.dictionary.file, limits_text(node, object)));
  }

  /// Words of the config for the values of an option code, from `first` on.
  std::optional<int> read_option(const CanNodeConfig& node, std::string_view name, ObjectKey object,
                                 const std::vector<std::string>& words, int first) const {
    if (!table_.has(name)) return std::nullopt;
    const std::string word = table_.choice(name, words);
    const int value = first + static_cast<int>(std::find(words.begin(), words.end(), word) - words.begin());
    needs_object(node, name, object, value);
    return value;
  }

  // CiA 402-2, 8.4.4 to 8.4.6
  void read_options(const CanNodeConfig& node, DriveSetup& setup) const {
    setup.at_shutdown = read_option(node, "at_shutdown", {0x605B, 0}, {"coast", "ramp"}, 0);
    setup.at_disable = read_option(node, "at_disable", {0x605C, 0}, {"coast", "ramp"}, 0);
    setup.at_halt = read_option(node, "at_halt", {0x605D, 0},
                                {"ramp", "quick_stop_ramp", "current_limit", "voltage_limit"}, 1);
  }

  // The move after homing: as fast as the search, at half of the joint's acceleration.
  void read_final(CanNodeConfig& node, double speed) const {
    const JointLimit& limit = joint().limit;
    Cia402Axis::Config& axis = node.link.axis;
    axis.period_s = timing_.period_s;
    axis.final_speed = std::min(speed, limit.velocity);
    axis.final_acceleration = 0.5 * limit.acceleration;
    if (!table_.has(key("home_final"))) return;
    axis.home_final = place_of(joint(), table_.number(key("home_final"), range_of_places(joint())));
    if (axis.absolute)
      throw table_.error(key("home_final"),
                         "a joint with an absolute encoder does not home, so that it goes nowhere");
  }

  DriveUnits read_units(CanNodeConfig& node) const {
    DriveUnitWish wish;
    wish.velocity = table_.text("velocity_unit", "");
    wish.acceleration = table_.text("acceleration_unit", "");
    wish.counts_per_revolution = table_.number("counts_per_revolution", 0.0, kNotNegative);
    node.counts_per_revolution = wish.counts_per_revolution;
    const bool linear = joint().kind != JointKind::kRotary;
    if (linear) wish.counts_per_m = 1000 * std::abs(node.link.axis.counts_per_unit);
    try {
      return drive_units(wish, node.dictionary);
    } catch (const DriveUnitError& error) {
      throw table_.error(error.key, error.what());
    }
  }

  // CiA 402-2 reserves what is between its methods; negative numbers are the maker's.
  int read_homing_method(const CanNodeConfig& node) const {
    const auto method = static_cast<int>(table_.integer("homing_method", 5, Range{-128, 37}));
    if (method == 0 && !node.link.axis.absolute)
      throw table_.error(
          "homing_method",
          "method 0 homes nothing (CiA 402-2); say absolute = true for an encoder that knows its "
          "place, or a method from 1 to 37");
    for (const int reserved : {15, 16, 31, 32, 36})
      if (method == reserved)
        throw table_.error("homing_method",
                           fmt::format("method {} is reserved by CiA 402-2, and no drive has it; legal: 1 to "
                                       "14, 17 to 30, 33, 34, 35, 37, and a maker's own from -128 to -1",
                                       method));
    return method;
  }

  DriveSetup read_setup(CanNodeConfig& node) {
    const JointLimit& limit = joint().limit;
    DriveSetup setup;
    setup.name = node.link.name;
    setup.period_s = timing_.period_s;
    setup.mode = node.link.axis.mode;
    setup.skip = read_skip(node.dictionary);
    setup.pdo_order = node.pdo_habits.order;
    setup.interpolation = read_interpolation(node, setup);
    setup.sync_counter = timing_.sync_counter;
    read_watch(node, setup);
    setup.holds_at_stop = node.link.brake.fitted;
    setup.output_mask = node.link.output_mask;
    if (node.link.brake.fitted && node.link.brake.of_drive)
      setup.output_mask |= std::int64_t{1} << node.link.brake.output;
    const double scale = node.link.axis.counts_per_unit;
    // Zero if the joint reaches it, else the end of its range next to zero.
    const double home = std::clamp(0.0, limit.min, limit.max);
    node.home = place_of(joint(), table_.number(key("home"), home / unit(), range_of_places(joint())));
    node.square = unit() * table_.number(key("square"), 0.0, kAnyNumber);
    node.home += node.square;
    node.link.home_group = static_cast<int>(table_.integer("home_group", 0, Range{0, 99}));
    node.homing_method = read_homing_method(node);
    setup.homes = !node.link.axis.absolute;
    setup.homing_method = node.homing_method;
    if (std::abs(node.home * scale) > std::numeric_limits<std::int32_t>::max())
      throw table_.error(key("home"), "the home point is beyond the 32 bits of a drive's counts");
    setup.home_counts = static_cast<std::int64_t>(std::nearbyint(node.home * scale));
    if (node.offset_is_zero) setup.home_counts = -setup.home_counts;
    const double rotary_factor = joint().kind == JointKind::kRotary ? 2 : 1;  // 20 mm/s, 10 deg/s
    const double search = unit() * table_.number(key("homing_speed", "_s"), 20.0 / rotary_factor, kPositive);
    read_final(node, search);
    const double slow = unit() * table_.number(key("index_speed", "_s"), 2.0 / rotary_factor, kPositive);
    const DriveUnits units = read_units(node);
    setup.units = units.objects;
    node.link.axis.velocity_units = units.velocity;
    node.units = units;
    int pdo = 0;
    PdoField field;
    const bool forces = find_field(node.link.rpdos, {0x60B2, 0}, pdo, field);
    read_torque(joint(), table_, node.dictionary, units, forces, node.link.axis);
    const auto speed = [&](double wanted, const std::string& what) {
      const std::int64_t out = units.velocity_at_most(std::min(wanted, limit.velocity) * scale);
      if (out > 0) return out;
      throw table_.error("velocity_unit",
                         fmt::format("one of the drive's units of velocity is faster than {}; say a finer "
                                     "'velocity_unit', as \"0.01 rpm\"",
                                     what));
    };
    setup.search_speed = speed(search, key("homing_speed", "_s"));
    setup.index_speed = speed(slow, key("index_speed", "_s"));
    setup.acceleration = units.acceleration_of(limit.acceleration * scale);
    setup.velocity = speed(limit.velocity, "the joint may go");
    // A quick stop brakes harder than any plan, since it need not keep the work.
    const double quick = table_.number("quick_stop_factor", 2.0, kPositive);
    setup.quick_stop = units.acceleration_of(quick * limit.acceleration * scale);
    read_limits(node, setup);
    read_options(node, setup);
    const auto told = [&](std::uint8_t sub) { return node.dictionary.integer({0x1018, sub}).value_or(0); };
    setup.vendor = table_.integer("vendor", static_cast<long>(told(1)), Range{0, 4294967295.0});
    setup.product = table_.integer("product", static_cast<long>(told(2)), Range{0, 4294967295.0});
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
  const CanTiming& timing_;
  const ConfigTable& table_;
  std::size_t joint_ = 0;
};

}  // namespace

CanNodeConfig read_can_node(const Machine& machine, const CanTiming& timing, const NodeBus& bus,
                            const ConfigTable& table) {
  return NodeReader(machine, timing, table).read(bus);
}

}  // namespace trn

#include "hal/can/feed_forward_config.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>

#include "core/units.h"

namespace trn {

namespace {

constexpr ObjectKey kVelocityOffsetObject{0x60B1, 0}, kTorqueOffsetObject{0x60B2, 0};

bool takes_offset(const ObjectDictionary& dictionary, ObjectKey key) {
  const DictionaryEntry* entry = dictionary.find(key);
  return entry && entry->mappable && entry->writable;
}

// Work of a turn: torque times 2 pi is force times the way, or the joint's torque times its angle. 0x6076 is
// in mNm, and N times mm are mNm as well.
double rated_by_sheet(const ObjectDictionary& dictionary, const DriveUnits& units, double counts_per_unit,
                      bool rotary) {
  const double rated_mNm = static_cast<double>(dictionary.integer({0x6076, 0}).value_or(0));
  const double way_of_turn = units.counts_per_motor_turn / std::abs(counts_per_unit);
  if (rated_mNm <= 0 || way_of_turn <= 0) return 0;
  return rated_mNm * 2 * kPi / way_of_turn * (rotary ? 1e-3 : 1);
}

}  // namespace

FeedForwardObjects feed_forward_objects(const ObjectDictionary& dictionary, Cia402Mode mode, int joint,
                                        const std::optional<FeedForwardConfig>& config) {
  FeedForwardObjects out;
  if (!config) return out;
  const bool position = mode == Cia402Mode::kCyclicPosition;
  const bool cyclic = position || mode == Cia402Mode::kCyclicVelocity || mode == Cia402Mode::kCyclicTorque;
  const auto want = [&](ObjectKey key) {
    (takes_offset(dictionary, key) ? out.mapped : out.missing).push_back(key);
  };
  // The narrow one first: it fills the PDO of control word and target.
  if (cyclic && config->torque && config->models[static_cast<std::size_t>(joint)]) want(kTorqueOffsetObject);
  if (position && config->velocity) want(kVelocityOffsetObject);
  return out;
}

void read_torque(const Joint& joint, const ConfigTable& table, const ObjectDictionary& dictionary,
                 const DriveUnits& units, bool forces, Cia402Axis::Config& axis) {
  const bool rotary = joint.kind == JointKind::kRotary;
  const std::string key = rotary ? "rated_torque_Nm" : "rated_force_N";
  const double by_sheet = rated_by_sheet(dictionary, units, axis.counts_per_unit, rotary);
  const double rated = table.number(key, by_sheet, kNotNegative);
  const bool torque_mode = axis.mode == Cia402Mode::kCyclicTorque;
  if (rated <= 0 && (forces || torque_mode))
    throw table.error(
        key, fmt::format("the drive's torque is in thousandths of the rated one; '{}' must say what that is "
                         "at the joint, because {} does not tell 0x6076 and 0x608F",
                         key, dictionary.file));
  if (rated > 0) axis.torque_units = std::copysign(1000 / rated, axis.counts_per_unit);
  const std::string at = rotary ? "torque_gain_Nm_s" : "torque_gain_N_s_mm";
  axis.torque_loop.gain_1_s = axis.gain_1_s;
  axis.torque_loop.damping = torque_mode ? table.number(at, kPositive) : table.number(at, 0.0, kNotNegative);
  axis.torque_loop.integral_time_s = table.number("integral_time_s", 0.05, kPositive);
  axis.torque_loop.force_max = rated;
  axis.torque_loop.period_s = axis.period_s;
}

}  // namespace trn

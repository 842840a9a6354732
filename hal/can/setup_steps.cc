#include "hal/can/setup_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hal/can/sdo.h"

namespace trn {

namespace {

using Kind = SetupStep::Kind;

// Bits 31 and 30 of a PDO's identifier: it is off; it is not sent on request (CiA 301, 7.5.2.35, 7.5.2.37).
constexpr std::uint32_t kPdoOff = 0x80000000, kNoRemote = 0x40000000;
constexpr std::uint16_t kPdosMax = 512;
constexpr std::uint32_t kDriveProfile = 402;

class StepList {
 public:
  explicit StepList(const ObjectDictionary& dictionary) : dictionary_(dictionary) {}

  void write(ObjectKey key, std::int64_t value, int bytes, std::string_view remedy,
             Kind kind = Kind::kWrite) {
    SetupStep step{kind, key, std::vector<std::uint8_t>(static_cast<std::size_t>(bytes)), name(key),
                   std::string(remedy)};
    put_le(step.bytes.data(), bytes, static_cast<std::uint64_t>(value));
    steps.push_back(step);
  }
  /// Only if the data sheet has the object.
  void write_if(ObjectKey key, std::int64_t value, std::string_view remedy, Kind kind = Kind::kWriteIfThere) {
    if (takes(key)) write(key, value, bits_of(dictionary_.find(key)->type) / 8, remedy, kind);
  }
  /// The same; the machine runs without it, so that a refusal is a warning. Not beyond the data sheet's
  /// limit.
  void wish(ObjectKey key, std::int64_t value, std::string_view remedy) {
    if (takes(key)) write_if(key, within_limits(key, value), remedy, Kind::kWish);
  }
  std::int64_t within_limits(ObjectKey key, std::int64_t value) const {
    const DictionaryEntry* entry = dictionary_.find(key);
    if (entry && entry->high) value = std::min(value, *entry->high);
    return entry && entry->low ? std::max(value, *entry->low) : value;
  }
  /// What a DCF sets. Communication objects (0x1000 to 0x1FFF) follow from the config.
  void write_configured() {
    // Identifiers and PDOs of the DCF may be of another network; those of this one are computed.
    for (const auto& [key, entry] : dictionary_.entries)
      if (!entry.configured.empty() && entry.writable && key.index >= 0x2000)
        steps.push_back({Kind::kWrite, key, entry.configured, entry.name,
                         fmt::format("the drive does not take the ParameterValue of {}:{}", dictionary_.file,
                                     entry.line)});
  }
  /// Compared if the data sheet has the object; a warning.
  void bound(ObjectKey key, std::int64_t value, Kind kind, std::string_view remedy, bool zero_passes) {
    const DictionaryEntry* entry = dictionary_.find(key);
    if (!entry || !entry->readable || bits_of(entry->type) == 0) return;
    steps.push_back(
        {kind, key, {}, name(key), std::string(remedy), value, is_signed(entry->type), zero_passes});
  }
  void check(ObjectKey key, std::int64_t value, int bytes, std::string_view remedy) {
    write(key, value, bytes, remedy, Kind::kCheck);
  }
  bool takes(ObjectKey key) const {
    const DictionaryEntry* entry = dictionary_.find(key);
    return entry && entry->writable && bits_of(entry->type) != 0;
  }
  /// Power-on value of a PDO's identifier; 0: none is known.
  std::uint32_t identifier(std::uint16_t record) const {
    return static_cast<std::uint32_t>(dictionary_.integer({record, 1}).value_or(0));
  }

  std::vector<SetupStep> steps;

 private:
  std::string name(ObjectKey key) const { return dictionary_.name_of(key); }
  const ObjectDictionary& dictionary_;
};

constexpr std::string_view kPdoRemedy =
    "the drive refuses this PDO; check the EDS against its firmware, and what order it wants and which PDOs "
    "are fixed "
    "('pdo_order' and 'fixed_pdos' in the node's habits)";

// One of the writes that make a PDO. A mapping can be changed only while the PDO is off, and its count only
// by way of 0. The identifier stays while it is switched off: a drive may refuse to change both at once.
void write_pdo(StepList& list, const Pdo& pdo, bool receive, PdoWrite what) {
  const auto record = static_cast<std::uint16_t>((receive ? 0x1400 : 0x1800) + pdo.number);
  const auto mapping = static_cast<std::uint16_t>((receive ? 0x1600 : 0x1A00) + pdo.number);
  switch (what) {
    case PdoWrite::kOff:
      return list.write({record, 1}, kPdoOff, 4, kPdoRemedy, Kind::kSetBits);
    case PdoWrite::kType:
      return list.write({record, 2}, pdo.transmission, 1, kPdoRemedy);
    case PdoWrite::kClear:
      return list.write({mapping, 0}, 0, 1, kPdoRemedy);
    case PdoWrite::kMap:
      for (std::size_t i = 0; i < pdo.fields.size(); ++i)
        list.write({mapping, static_cast<std::uint8_t>(i + 1)}, pdo.fields[i].mapping(), 4, kPdoRemedy);
      return;
    case PdoWrite::kCount:
      return list.write({mapping, 0}, static_cast<std::int64_t>(pdo.fields.size()), 1, kPdoRemedy);
    case PdoWrite::kOn:
      return list.write({record, 1}, pdo.id | (list.identifier(record) & kNoRemote), 4, kPdoRemedy);
  }
}

// CiA 301, 7.5.2.35: switch the PDO off, change it, switch it on
void add_pdo(StepList& list, const Pdo& pdo, bool receive, const PdoOrder& order) {
  for (const PdoWrite what : order) {
    const bool maps = what == PdoWrite::kClear || what == PdoWrite::kMap || what == PdoWrite::kCount;
    if (!maps || !pdo.fixed) write_pdo(list, pdo, receive, what);
  }
}

void check_pdo(StepList& list, const Pdo& pdo, bool receive) {
  const auto mapping = static_cast<std::uint16_t>((receive ? 0x1600 : 0x1A00) + pdo.number);
  constexpr std::string_view kRemedy =
      "the drive keeps another mapping than it was given; check its firmware";
  list.check({mapping, 0}, static_cast<std::int64_t>(pdo.fields.size()), 1, kRemedy);
  for (std::size_t i = 0; i < pdo.fields.size(); ++i)
    list.check({mapping, static_cast<std::uint8_t>(i + 1)}, pdo.fields[i].mapping(), 4, kRemedy);
}

// Drives come with PDOs of their maker's. Left on, they would load the bus beyond its budget, and one that
// sends under an identifier of ours would be taken for feedback.
void switch_off_unused(StepList& list, std::uint16_t first, const std::vector<Pdo>& used) {
  constexpr std::string_view kRemedy = "the drive cannot switch this PDO off; it would load the bus";
  for (std::uint16_t i = 0; i < kPdosMax; ++i) {
    if (std::any_of(used.begin(), used.end(), [i](const Pdo& pdo) { return pdo.number == i; })) continue;
    const auto record = static_cast<std::uint16_t>(first + i);
    const std::uint32_t id = list.identifier(record);
    // The first four have identifiers by the standard; of the others only those that the data sheet switches
    // on.
    const bool may_be_on = i < 4 || (id != 0 && !(id & kPdoOff));
    if (may_be_on && list.takes({record, 1})) list.write({record, 1}, kPdoOff, 4, kRemedy, Kind::kSetBits);
  }
}

void add_pdos(StepList& list, const std::vector<Pdo>& rpdos, const std::vector<Pdo>& tpdos,
              const PdoOrder& order) {
  for (const Pdo& pdo : rpdos) add_pdo(list, pdo, true, order);
  for (const Pdo& pdo : tpdos) add_pdo(list, pdo, false, order);
  switch_off_unused(list, 0x1400, rpdos);
  switch_off_unused(list, 0x1800, tpdos);
  // Read back: some drives take every entry without complaint and keep their own.
  for (const Pdo& pdo : rpdos) check_pdo(list, pdo, true);
  for (const Pdo& pdo : tpdos) check_pdo(list, pdo, false);
}

void add_identity(StepList& list, const DriveSetup& setup) {
  // Before anything is written: settings of one drive may do harm in another.
  constexpr std::string_view kRemedy =
      "another drive has this node id, or the EDS is another drive's; 'vendor' and 'product' of the node "
      "say what may be here, 0 takes any";
  if (setup.vendor != 0) list.write({0x1018, 1}, setup.vendor, 4, kRemedy, Kind::kCheckIfThere);
  if (setup.product != 0) list.write({0x1018, 2}, setup.product, 4, kRemedy, Kind::kCheckIfThere);
}

// Who watches whom, and how (CiA 301, 7.2.8.2): a node guards or beats, never both.
void add_watch(StepList& list, const DriveSetup& setup) {
  list.write_if({0x1017, 0}, setup.heartbeat_ms, "the drive cannot send heartbeats; set drives.guarding_ms",
                setup.heartbeat_ms > 0 ? Kind::kWrite : Kind::kWish);
  const std::int64_t consumer =
      setup.heartbeat_timeout_ms > 0
          ? static_cast<std::int64_t>(setup.master_id) << 16 | setup.heartbeat_timeout_ms
          : 0;
  list.write_if({0x1016, 1}, consumer, "the drive cannot watch the master's heartbeat",
                consumer != 0 ? Kind::kWrite : Kind::kWish);
  if (setup.guard_ms == 0) return;
  constexpr std::string_view kRemedy = "the drive does not take this guard time; see drives.guarding_ms";
  list.write_if({0x100C, 0}, setup.guard_ms, kRemedy, Kind::kWrite);
  list.write_if({0x100D, 0}, setup.life_time_factor, kRemedy, Kind::kWrite);
}

void add_sync(StepList& list, const DriveSetup& setup) {
  constexpr std::string_view kRemedy = "the drive cannot follow this SYNC period";
  if (setup.sync_counter > 0) {  // changes only while there is no SYNC period (CiA 301, 7.5.2.22)
    list.write_if({0x1006, 0}, 0, kRemedy);
    list.write_if({0x1019, 0}, setup.sync_counter,
                  "the drive knows no counter in SYNC; leave sync_counter out");
  }
  list.wish({0x1006, 0}, std::lround(1e6 * setup.period_s), kRemedy);
}

void add_homing(StepList& list, const DriveSetup& setup) {
  constexpr std::string_view kRemedy = "value not accepted by the drive; check the config of this node";
  // A drive that has one method may tell it, and takes no other.
  if (list.takes({0x6098, 0}))
    list.write({0x6098, 0}, setup.homing_method, 1, "the drive does not know this homing_method; see 0x60E3");
  else
    list.write({0x6098, 0}, setup.homing_method, 1, "the drive has another homing_method and no choice",
               Kind::kCheckIfThere);
  list.write_if({0x607C, 0}, setup.home_counts, kRemedy);
  list.write_if({0x6099, 1}, list.within_limits({0x6099, 1}, setup.search_speed), kRemedy);
  list.write_if({0x6099, 2}, list.within_limits({0x6099, 2}, setup.index_speed), kRemedy);
  list.wish({0x609A, 0}, setup.acceleration, kRemedy);
}

// Before any speed or ramp: these are in units, which must be the ones that were reckoned with.
void add_units(StepList& list, const DriveSetup& setup, const ObjectDictionary& dictionary) {
  for (const DriveUnits::Object& object : setup.units) {
    const int bytes = bits_of(dictionary.find(object.key)->type) / 8;
    list.write(object.key, object.value, bytes,
               "the drive counts in other units than its data sheet says; see 'velocity_unit', "
               "'acceleration_unit' and 'counts_per_revolution' of the node",
               object.written ? Kind::kWrite : Kind::kCheckIfThere);
  }
}

// How it stops when it is told to. Asked for by the config, so that a refusal is no small matter.
void add_options(StepList& list, const DriveSetup& setup) {
  const auto add = [&](ObjectKey key, const std::optional<int>& value, std::string_view name) {
    if (value)
      list.write_if(
          key, *value,
          fmt::format("the drive cannot stop in this way; see '{}' of the node, and the drive's manual",
                      name),
          Kind::kWrite);
  };
  add({0x605B, 0}, setup.at_shutdown, "at_shutdown");
  add({0x605C, 0}, setup.at_disable, "at_disable");
  add({0x605D, 0}, setup.at_halt, "at_halt");
}

void add_drive(StepList& list, const DriveSetup& setup) {
  constexpr std::string_view kRemedy = "value not accepted by the drive; check the config of this node";
  list.write({0x6060, 0}, static_cast<std::int64_t>(setup.mode), 1,
             "the drive does not know this mode; see 0x6502 and the node's 'mode'");
  if (setup.interpolation) {
    constexpr std::string_view kPeriod =
        "the drive cannot interpolate over this period; change machine.period_s or interpolation_period";
    list.write_if({0x60C2, 1}, setup.interpolation->value, kPeriod);
    list.write_if({0x60C2, 2}, setup.interpolation->exponent, kPeriod);
  }
  list.wish({0x6007, 0}, 3, kRemedy);  // connection lost: quick stop
  // Quick stop: by its ramp, then Switch On Disabled. A drive that has a brake goes on holding until it is
  // told.
  if (setup.holds_at_stop)
    list.write_if({0x605A, 0}, 6,
                  "the drive cannot hold the axis until its brake does; see [[safety.brake]]");
  else
    list.wish({0x605A, 0}, 2, kRemedy);
  if (setup.output_mask != 0)
    list.write_if({0x60FE, 2}, setup.output_mask,
                  "the drive does not let this output go; see [[safety.brake]]");
  list.wish({0x605E, 0}, 2, kRemedy);  // fault: by the quick stop ramp
  add_options(list, setup);
  list.wish({0x6085, 0}, setup.quick_stop, kRemedy);
  // A profile is what the other modes do not have.
  if (setup.mode == Cia402Mode::kProfilePosition) {
    list.write_if({0x6081, 0}, list.within_limits({0x6081, 0}, setup.velocity), kRemedy);
    list.wish({0x6083, 0}, setup.acceleration, kRemedy);
    list.wish({0x6084, 0}, setup.acceleration, kRemedy);
  }
  // An absolute encoder has no homing, and a drive for one may not know these objects.
  if (setup.homes) add_homing(list, setup);
}

// The drive's own limits against ours: what is tighter there would stop it in the middle of a program.
void add_limits(StepList& list, const DriveSetup& setup) {
  constexpr std::string_view kRefused =
      "the drive does not take this limit of its own; leave out drive_limits";
  if (setup.sets_limits) {
    list.wish({0x607D, 1}, setup.range_low, kRefused);
    list.wish({0x607D, 2}, setup.range_high, kRefused);
    if (setup.following_counts > 0) list.wish({0x6065, 0}, setup.following_counts, kRefused);
    if (setup.following_ms) list.wish({0x6066, 0}, *setup.following_ms, kRefused);
  }
  constexpr std::string_view kSet = "set it in the drive, or drive_limits = \"set\" in the config";
  constexpr std::string_view kRange =
      "the drive's range is less than the joint's; set it in the drive, or drive_limits = \"set\" in the "
      "config";
  if (!setup.endless) {
    list.bound({0x607D, 1}, setup.range_low, Kind::kAtMost, kRange, true);
    list.bound({0x607D, 2}, setup.range_high, Kind::kAtLeast, kRange, true);
  }
  if (setup.following_counts > 0) list.bound({0x6065, 0}, setup.following_counts, Kind::kAtLeast, kSet, true);
  // Too short, a spike of the error ends a program; too long, the drive pushes against what blocks it.
  if (setup.following_ms) {
    list.bound({0x6066, 0}, *setup.following_ms, Kind::kAtLeast, kSet, false);
    list.bound({0x6066, 0}, *setup.following_ms, Kind::kAtMost, kSet, false);
  }
  list.bound({0x6072, 0}, 1, Kind::kAtLeast, "the drive may use no torque at all", false);
  if (setup.motor_rpm > 0)
    list.bound({0x6080, 0}, setup.motor_rpm, Kind::kAtLeast,
               "the motor may not turn as fast as the joint's limit asks for", true);
}

bool is_read(Kind kind) {
  return kind == Kind::kCheck || kind == Kind::kCheckIfThere || kind == Kind::kAtMost ||
         kind == Kind::kAtLeast;
}

/// Limits of one sub-object of 0x60C2.
bool allows(const ObjectDictionary& dictionary, std::uint8_t sub, std::int64_t value) {
  const DictionaryEntry* entry = dictionary.find({0x60C2, sub});
  return !entry || ((!entry->low || value >= *entry->low) && (!entry->high || value <= *entry->high));
}

}  // namespace

std::optional<InterpolationTime> interpolation_time(double period_s, const ObjectDictionary& dictionary) {
  if (!dictionary.find({0x60C2, 1})) return std::nullopt;
  // Milliseconds first: drives accept few exponents, most of them -3. The value has 8 bits.
  for (const int exponent : {-3, -4, -5, -6, -2, -1, 0}) {
    const double exact = period_s * std::pow(10.0, -exponent);
    const long value = std::lround(exact);
    const bool whole = std::abs(exact - static_cast<double>(value)) < 1e-6 * exact;
    if (whole && value >= 1 && value <= 255 && allows(dictionary, 1, value) &&
        allows(dictionary, 2, exponent))
      return InterpolationTime{static_cast<int>(value), exponent};
  }
  return std::nullopt;
}

void leave_out(const std::vector<std::string>& skip, std::vector<SetupStep>& steps) {
  std::erase_if(steps, [&](const SetupStep& step) {
    const auto names = [&](const std::string& text) {
      return text == to_string(step.key) || text == fmt::format("0x{:04X}", step.key.index);
    };
    return !is_read(step.kind) && std::any_of(skip.begin(), skip.end(), names);
  });
}

SetupStep signature_step(const std::vector<SetupStep>& steps, const ObjectDictionary& dictionary) {
  // In this order: what nobody but a master writes, then what may also have been stored in the drive.
  for (const ObjectKey key : {ObjectKey{0x1016, 1}, ObjectKey{0x100C, 0}, ObjectKey{0x1006, 0},
                              ObjectKey{0x1800, 2}, ObjectKey{0x1400, 2}}) {
    const DictionaryEntry* entry = dictionary.find(key);
    for (const SetupStep& step : steps)
      if (entry && entry->readable && step.key == key && !is_read(step.kind) && step.bytes != entry->value)
        return {Kind::kCheck, key, step.bytes, step.what, ""};
  }
  return {Kind::kCheck, {0x1000, 0}, {}, "device type", ""};
}

std::vector<SetupStep> setup_steps(const DriveSetup& setup, const ObjectDictionary& dictionary,
                                   const std::vector<Pdo>& rpdos, const std::vector<Pdo>& tpdos) {
  StepList list(dictionary);
  const std::int64_t type = dictionary.integer({0x1000, 0}).value_or(0x20000 | kDriveProfile);
  list.check({0x1000, 0}, type, 4, "another device has this node id, or the EDS is another drive's");
  add_identity(list, setup);
  // The DCF first, so that what the config and this master say about the same objects comes later and stays.
  list.write_configured();
  add_watch(list, setup);
  add_sync(list, setup);
  add_pdos(list, rpdos, tpdos, setup.pdo_order);
  add_units(list, setup, dictionary);
  add_drive(list, setup);
  add_limits(list, setup);
  leave_out(setup.skip, list.steps);
  return list.steps;
}

}  // namespace trn

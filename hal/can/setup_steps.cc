#include "hal/can/setup_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hal/can/sdo.h"

namespace trn {

namespace {

using Kind = SetupStep::Kind;

constexpr std::uint32_t kPdoOff = 0x80000000;
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
  void write_if(ObjectKey key, std::int64_t value, std::string_view remedy) {
    const DictionaryEntry* entry = dictionary_.find(key);
    if (!entry || !entry->writable || bits_of(entry->type) == 0) return;
    write(key, value, bits_of(entry->type) / 8, remedy, Kind::kWriteIfThere);
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
  void check(ObjectKey key, std::int64_t value, int bytes, std::string_view remedy) {
    write(key, value, bytes, remedy, Kind::kCheck);
  }
  bool has(ObjectKey key) const { return dictionary_.find(key) != nullptr; }

  std::vector<SetupStep> steps;

 private:
  std::string name(ObjectKey key) const { return dictionary_.name_of(key); }
  const ObjectDictionary& dictionary_;
};

// CiA 301, 7.5.2.35: switch the PDO off, change it, switch it on
void add_pdo(StepList& list, const Pdo& pdo, bool receive) {
  const auto record = static_cast<std::uint16_t>((receive ? 0x1400 : 0x1800) + pdo.number);
  const auto mapping = static_cast<std::uint16_t>((receive ? 0x1600 : 0x1A00) + pdo.number);
  constexpr std::string_view kRemedy = "the drive refuses this PDO; check the EDS against its firmware";
  // Bit 31 of the identifier. A mapping can be changed only while the PDO is off, and its count only by way
  // of 0.
  list.write({record, 1}, pdo.id | kPdoOff, 4, kRemedy);
  list.write({record, 2}, pdo.transmission, 1, kRemedy);
  list.write({mapping, 0}, 0, 1, kRemedy);
  for (std::size_t i = 0; i < pdo.fields.size(); ++i)
    list.write({mapping, static_cast<std::uint8_t>(i + 1)}, pdo.fields[i].mapping(), 4, kRemedy);
  list.write({mapping, 0}, static_cast<std::int64_t>(pdo.fields.size()), 1, kRemedy);
  list.write({record, 1}, pdo.id, 4, kRemedy);
}

void check_pdo(StepList& list, const Pdo& pdo, bool receive) {
  const auto mapping = static_cast<std::uint16_t>((receive ? 0x1600 : 0x1A00) + pdo.number);
  constexpr std::string_view kRemedy =
      "the drive keeps another mapping than it was given; check its firmware";
  list.check({mapping, 0}, static_cast<std::int64_t>(pdo.fields.size()), 1, kRemedy);
  for (std::size_t i = 0; i < pdo.fields.size(); ++i)
    list.check({mapping, static_cast<std::uint8_t>(i + 1)}, pdo.fields[i].mapping(), 4, kRemedy);
}

void add_pdos(StepList& list, const std::vector<Pdo>& rpdos, const std::vector<Pdo>& tpdos) {
  for (const Pdo& pdo : rpdos) add_pdo(list, pdo, true);
  for (const Pdo& pdo : tpdos) add_pdo(list, pdo, false);
  constexpr std::string_view kRemedy = "the drive cannot switch this PDO off; it would load the bus";
  // Drives come with PDOs of their maker's. Left on, they would load the bus beyond its budget, and one that
  // sends under an identifier of ours would be taken for feedback.
  for (std::uint16_t i = static_cast<std::uint16_t>(rpdos.size()); i < 4; ++i)
    if (list.has({static_cast<std::uint16_t>(0x1400 + i), 1}))
      list.write({static_cast<std::uint16_t>(0x1400 + i), 1}, kPdoOff, 4, kRemedy, Kind::kWriteIfThere);
  for (std::uint16_t i = static_cast<std::uint16_t>(tpdos.size()); i < 4; ++i)
    if (list.has({static_cast<std::uint16_t>(0x1800 + i), 1}))
      list.write({static_cast<std::uint16_t>(0x1800 + i), 1}, kPdoOff, 4, kRemedy, Kind::kWriteIfThere);
  // Read back: some drives take every entry without complaint and keep their own.
  for (const Pdo& pdo : rpdos) check_pdo(list, pdo, true);
  for (const Pdo& pdo : tpdos) check_pdo(list, pdo, false);
}

// 0x60C2: period = value * 10^index s (CiA 402-2, 12.4.4)
void add_period(StepList& list, double period_s) {
  int exponent = -6;
  long value = std::lround(period_s * 1e6);
  // 1 ms is 1 * 10^-3 and not 100 * 10^-5: drives accept few exponents, and the value has 8 bits.
  for (; value % 10 == 0 && exponent < 0; ++exponent) value /= 10;
  for (; value > 255; ++exponent) value /= 10;
  constexpr std::string_view kRemedy =
      "the drive cannot interpolate over this period; change machine.period_s";
  list.write_if({0x60C2, 1}, value, kRemedy);
  list.write_if({0x60C2, 2}, exponent, kRemedy);
}

void add_drive(StepList& list, const DriveSetup& setup) {
  constexpr std::string_view kRemedy = "value not accepted by the drive; check the config of this node";
  list.write({0x6060, 0}, static_cast<std::int64_t>(setup.mode), 1,
             "the drive does not know this mode; see 0x6502 and the node's 'mode'");
  add_period(list, setup.period_s);
  list.write_if({0x6007, 0}, 3, kRemedy);  // connection lost: quick stop
  list.write_if({0x605A, 0}, 2, kRemedy);  // quick stop: by its ramp, then Switch On Disabled
  list.write_if({0x605E, 0}, 2, kRemedy);  // fault: by the quick stop ramp
  list.write_if({0x6085, 0}, setup.quick_stop_counts_s2, kRemedy);
  list.write_if({0x6081, 0}, setup.velocity_counts_s, kRemedy);
  list.write_if({0x6083, 0}, setup.acceleration_counts_s2, kRemedy);
  list.write_if({0x6084, 0}, setup.acceleration_counts_s2, kRemedy);
  // An absolute encoder has no homing, and a drive for one may not know these objects.
  if (!setup.homes) return;
  list.write({0x6098, 0}, setup.homing_method, 1, "the drive does not know this homing_method; see 0x60E3");
  list.write_if({0x607C, 0}, setup.home_counts, kRemedy);
  list.write_if({0x6099, 1}, setup.search_counts_s, kRemedy);
  list.write_if({0x6099, 2}, setup.index_counts_s, kRemedy);
  list.write_if({0x609A, 0}, setup.acceleration_counts_s2, kRemedy);
}

}  // namespace

SetupStep signature_step(const DriveSetup& setup) {
  const ObjectDictionary nothing;
  StepList list(nothing);
  list.check({0x1016, 1}, static_cast<std::int64_t>(setup.master_id) << 16 | setup.heartbeat_timeout_ms, 4,
             "");
  return list.steps[0];
}

std::vector<SetupStep> setup_steps(const DriveSetup& setup, const ObjectDictionary& dictionary,
                                   const std::vector<Pdo>& rpdos, const std::vector<Pdo>& tpdos) {
  StepList list(dictionary);
  const std::int64_t type = dictionary.integer({0x1000, 0}).value_or(0x20000 | kDriveProfile);
  list.check({0x1000, 0}, type, 4, "another device has this node id, or the EDS is another drive's");
  // Before anything is written: settings of one drive may do harm in another.
  if (setup.vendor != 0) list.check({0x1018, 1}, setup.vendor, 4, "another maker's drive has this node id");
  if (setup.product != 0) list.check({0x1018, 2}, setup.product, 4, "another drive has this node id");
  // The DCF first, so that what the config and this master say about the same objects comes later and stays.
  list.write_configured();
  list.write({0x1017, 0}, setup.heartbeat_ms, 2,
             "the drive cannot send heartbeats; set drives.guarding_ms instead");
  list.write({0x1016, 1}, static_cast<std::int64_t>(setup.master_id) << 16 | setup.heartbeat_timeout_ms, 4,
             "the drive cannot watch the master's heartbeat");
  if (setup.sync_counter > 0) {  // changes only while there is no SYNC period (CiA 301, 7.5.2.22)
    list.write_if({0x1006, 0}, 0, "the drive cannot follow this SYNC period");
    list.write_if({0x1019, 0}, setup.sync_counter,
                  "the drive knows no counter in SYNC; leave sync_counter out");
  }
  list.write_if({0x1006, 0}, std::lround(1e6 * setup.period_s), "the drive cannot follow this SYNC period");
  add_pdos(list, rpdos, tpdos);
  add_drive(list, setup);
  return list.steps;
}

}  // namespace trn

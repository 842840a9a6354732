#include "sim/canopen/object_store.h"

#include <algorithm>

namespace trn {

namespace {

constexpr std::uint32_t kPdoOff = 0x80000000, kIdentifier = 0x1FFFFFFF, kSave = 0x65766173;

bool in_range(std::uint16_t index, unsigned first) { return index >= first && index < first + 4; }
bool is_mapping(std::uint16_t index) { return in_range(index, 0x1600) || in_range(index, 0x1A00); }
bool is_record(std::uint16_t index) { return in_range(index, 0x1400) || in_range(index, 0x1800); }
bool is_receive(std::uint16_t index) { return index < 0x1800; }

}  // namespace

ObjectStore::ObjectStore(const ObjectDictionary& dictionary, int pdo_bytes)
    : dictionary_(dictionary), pdo_bytes_(pdo_bytes) {
  restore(false);
}

void ObjectStore::restore(bool communication_only) {
  // 0x1000 to 0x1FFF is the communication profile.
  for (const auto& [key, entry] : dictionary_.entries)
    if (!communication_only || key.index < 0x2000) {
      const auto stored = stored_.find(key);
      values_[key] = stored == stored_.end() ? entry.value : stored->second;
    }
}

// The values stay where they are: drive and PDOs have found them.
void ObjectStore::take_defaults(const ObjectDictionary& dictionary) {
  for (const auto& [key, entry] : dictionary.entries) {
    const auto known = dictionary_.entries.find(key);
    if (known != dictionary_.entries.end()) known->second.value = entry.value;
  }
}

// What others may set and no PDO carries; setpoints are not stored (CiA 301, 7.5.2.13).
std::uint32_t ObjectStore::save(ObjectKey key, std::int64_t signature) {
  if (signature != kSave) return sdo_abort::kStore;
  if (!stores_) return sdo_abort::kHardware;
  for (const auto& [object, entry] : dictionary_.entries) {
    const bool communication = object.index < 0x2000, is_0x1010 = object.index == 0x1010;
    const bool wanted = key.sub == 1 || (key.sub == 2 ? communication : !communication);
    if (wanted && entry.writable && !entry.mappable && !is_0x1010) stored_[object] = values_[object];
  }
  return 0;
}

std::vector<std::uint8_t>* ObjectStore::bytes(ObjectKey key) {
  const auto found = values_.find(key);
  return found == values_.end() ? nullptr : &found->second;
}

std::int64_t ObjectStore::integer(ObjectKey key) const {
  const auto found = values_.find(key);
  return found == values_.end() ? 0 : decode_integer(dictionary_.entries.at(key).type, found->second);
}

void ObjectStore::set(ObjectKey key, std::int64_t value) {
  const auto found = values_.find(key);
  if (found != values_.end() && !found->second.empty())
    put_le(found->second.data(), static_cast<int>(found->second.size()), static_cast<std::uint64_t>(value));
}

std::uint32_t ObjectStore::read(ObjectKey key, std::vector<std::uint8_t>& bytes) const {
  const auto found = values_.find(key);
  if (found == values_.end())
    return dictionary_.find({key.index, 0}) ? sdo_abort::kNoSub : sdo_abort::kNoObject;
  if (!dictionary_.entries.at(key).readable) return sdo_abort::kWriteOnly;
  bytes = found->second;
  return 0;
}

std::uint32_t ObjectStore::write(ObjectKey key, std::span<const std::uint8_t> bytes) {
  const auto found = values_.find(key);
  if (found == values_.end())
    return dictionary_.find({key.index, 0}) ? sdo_abort::kNoSub : sdo_abort::kNoObject;
  const DictionaryEntry& entry = dictionary_.entries.at(key);
  const bool mapping_count = is_mapping(key.index) && key.sub == 0;
  if (!entry.writable && !mapping_count) return sdo_abort::kReadOnly;
  // Strings and domains have no size of their own, and any length fits.
  const std::size_t size = static_cast<std::size_t>(bits_of(entry.type) / 8);
  if (size != 0 && bytes.size() > size) return sdo_abort::kTooLong;
  if (size != 0 && bytes.size() < size) return sdo_abort::kTooShort;
  const std::int64_t value = decode_integer(entry.type, bytes);
  if (size != 0 && entry.high && value > *entry.high) return sdo_abort::kValueHigh;
  if (size != 0 && entry.low && value < *entry.low) return sdo_abort::kValueLow;
  // Checked last: a value that does not even fit its object is refused for that reason.
  if (const std::uint32_t refused = check_pdo_habits(key, value)) return refused;
  if (const std::uint32_t refused = check_pdo_write(key, value)) return refused;
  if (key.index == 0x1010 && key.sub > 0) return save(key, value);
  found->second.assign(bytes.begin(), bytes.end());
  return 0;
}

// By the drive's own habits: one write after another. It may be done again, and be begun anew.
std::uint32_t ObjectStore::check_pdo_habits(ObjectKey key, std::int64_t value) {
  const bool maps = is_mapping(key.index);
  if (!maps && !is_record(key.index)) return 0;
  const bool receive = (maps ? key.index - 0x200 : key.index) < 0x1800;
  const auto record = static_cast<std::uint16_t>(maps ? key.index - 0x200 : key.index);
  if (maps && habits_.fixed(receive, key.index & 3)) return sdo_abort::kReadOnly;
  if (!habits_.strict || (!maps && key.sub > 2)) return 0;
  const bool off = static_cast<std::uint32_t>(value) & kPdoOff;
  const PdoWrite write = maps           ? key.sub != 0 ? PdoWrite::kMap
                                          : value == 0 ? PdoWrite::kClear
                                                       : PdoWrite::kCount
                         : key.sub == 2 ? PdoWrite::kType
                         : off          ? PdoWrite::kOff
                                        : PdoWrite::kOn;
  const std::ptrdiff_t at =
      std::find(habits_.order.begin(), habits_.order.end(), write) - habits_.order.begin();
  std::ptrdiff_t& done = written_.try_emplace(record, kPdoWrites - 1).first->second;
  const bool skips_map = habits_.fixed(receive, record & 3);
  if (at != 0 && at != done && at != done + 1 && !skips_map && write != PdoWrite::kOff)
    return sdo_abort::kState;
  done = at;
  return 0;
}

// A mapping changes only while its PDO is off and, but for sub-index 0, while it is empty (CiA
// 301, 7.5.2.36).
std::uint32_t ObjectStore::check_pdo_write(ObjectKey key, std::int64_t value) const {
  // A drive with an order of its own goes by that alone.
  if (habits_.strict && is_mapping(key.index) && key.sub == 0) return check_mapping_length(key, value);
  if (is_record(key.index) && key.sub == 1) return check_identifier(key, static_cast<std::uint32_t>(value));
  if (!is_mapping(key.index)) return 0;
  const auto record = static_cast<std::uint16_t>(key.index - 0x200);
  const bool off = static_cast<std::uint32_t>(integer({record, 1})) & kPdoOff;
  if (!off) return sdo_abort::kAccess;
  return key.sub == 0 ? check_mapping_length(key, value) : check_mapping(key, value);
}

// While a PDO is on its identifier stays (CiA 301, 7.5.2.35).
std::uint32_t ObjectStore::check_identifier(ObjectKey key, std::uint32_t value) const {
  const auto now = static_cast<std::uint32_t>(integer(key));
  const bool other = (value & kIdentifier) != (now & kIdentifier);
  if (other && !(now & kPdoOff)) return sdo_abort::kValueRange;
  return (value & kIdentifier) == 0 ? sdo_abort::kValueRange : 0;
}

std::uint32_t ObjectStore::check_mapping(ObjectKey key, std::int64_t value) const {
  if (integer({key.index, 0}) != 0) return sdo_abort::kAccess;
  const ObjectKey object{static_cast<std::uint16_t>(value >> 16), static_cast<std::uint8_t>(value >> 8)};
  const DictionaryEntry* entry = dictionary_.find(object);
  if (!entry) return sdo_abort::kNoObject;
  const bool legal = entry->mappable && (value & 0xFF) == bits_of(entry->type) &&
                     (is_receive(key.index) ? entry->writable : entry->readable);
  return legal ? 0 : sdo_abort::kNotMappable;
}

std::uint32_t ObjectStore::check_mapping_length(ObjectKey key, std::int64_t count) const {
  std::int64_t bits = 0;
  for (std::int64_t sub = 1; sub <= count; ++sub) {
    const ObjectKey object{key.index, static_cast<std::uint8_t>(sub)};
    if (!has(object)) return sdo_abort::kValueHigh;
    // The low byte of a mapping entry is the object's length in bits.
    bits += integer(object) & 0xFF;
  }
  return bits > 8 * pdo_bytes_ ? sdo_abort::kPdoLength : 0;
}

}  // namespace trn

#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <vector>

#include "hal/can/eds.h"
#include "hal/can/pdo.h"
#include "hal/can/sdo.h"

namespace trn {

/// The object dictionary of an emulated node: values, with the access rules of its data sheet.
class ObjectStore {
 public:
  /// `pdo_bytes`: what fits into a PDO, 8, over CAN FD 64.
  explicit ObjectStore(const ObjectDictionary& dictionary, int pdo_bytes = 8);

  /// As an SDO: 0, or the abort code (CiA 301, table 22).
  std::uint32_t read(ObjectKey key, std::vector<std::uint8_t>& bytes) const;
  std::uint32_t write(ObjectKey key, std::span<const std::uint8_t> bytes);
  /// As the node itself, without rules; the object must be there.
  std::int64_t integer(ObjectKey key) const;
  void set(ObjectKey key, std::int64_t value);
  bool has(ObjectKey key) const { return values_.count(key) != 0; }
  /// The value's own bytes, for PDOs; null if there is no such object.
  std::vector<std::uint8_t>* bytes(ObjectKey key);
  /// Power-on values, or what was stored since (0x1010), of everything or of the communication profile area
  /// only (0x1000 to 0x1FFF).
  void restore(bool communication_only);
  /// The memory behind 0x1010 is broken (`stores` false): "save" is refused.
  void set_stores(bool stores) { stores_ = stores; }
  /// PDOs are mapped in this order or not at all, and some not at all.
  void set_pdo_habits(const PdoHabits& habits) { habits_ = habits; }
  /// Power-on values of the same node with another id.
  void take_defaults(const ObjectDictionary& dictionary);
  const ObjectDictionary& dictionary() const { return dictionary_; }

 private:
  std::uint32_t check_pdo_habits(ObjectKey key, std::int64_t value);
  std::uint32_t save(ObjectKey key, std::int64_t signature);
  std::uint32_t check_pdo_write(ObjectKey key, std::int64_t value) const;
  std::uint32_t check_identifier(ObjectKey key, std::uint32_t value) const;
  std::uint32_t check_mapping(ObjectKey key, std::int64_t value) const;
  std::uint32_t check_mapping_length(ObjectKey key, std::int64_t count) const;

  ObjectDictionary dictionary_;
  int pdo_bytes_;
  bool stores_ = true;
  PdoHabits habits_;
  std::map<std::uint16_t, std::ptrdiff_t> written_;  ///< by PDO, how far it has come in its order
  std::map<ObjectKey, std::vector<std::uint8_t>> values_, stored_;
};

}  // namespace trn

#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "hal/can/sdo.h"

namespace trn {

/// A file that is no electronic data sheet; what() is "file:line: message".
struct EdsError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Data types, CiA 301, 7.4.7.1, table 44; other codes are kept as they are.
enum class DataType : std::uint16_t {
  kUnknown = 0,
  kBoolean = 1,
  kInteger8 = 2,
  kInteger16 = 3,
  kInteger32 = 4,
  kUnsigned8 = 5,
  kUnsigned16 = 6,
  kUnsigned32 = 7,
  kReal32 = 8,
  kVisibleString = 9,
  kOctetString = 0xA,
  kUnicodeString = 0xB,
  kDomain = 0xF,
  kReal64 = 0x11,
  kInteger64 = 0x15,
  kUnsigned64 = 0x1B
};
/// Bits of a value; 0: the length varies.
int bits_of(DataType type);
bool is_signed(DataType type);

/// One object, or one sub-object, of a node's dictionary.
struct DictionaryEntry {
  std::string name;
  DataType type = DataType::kUnknown;
  bool readable = true, writable = false, mappable = false;
  std::vector<std::uint8_t> value;       ///< default; node id already added
  std::vector<std::uint8_t> configured;  ///< the DCF's ParameterValue; empty: none
  std::optional<std::int64_t> low, high;
  int line = 0;  ///< of its section
};

/// An object dictionary as its data sheet describes it (CiA 306-1).
struct ObjectDictionary {
  std::string file, vendor, product;
  std::map<ObjectKey, DictionaryEntry> entries;
  std::optional<int> node_id;         ///< of a DCF, [DeviceComissioning]
  std::vector<std::string> warnings;  ///< "file:line: what was strange, and how it was taken"

  const DictionaryEntry* find(ObjectKey key) const;
  /// Name of the object, with the parent's in front of a sub-object's; "" if it is not there.
  std::string name_of(ObjectKey key) const;
  /// Default as an integer; nothing for strings and objects without one.
  std::optional<std::int64_t> integer(ObjectKey key) const;
  /// The object of this name (any case), or nothing.
  std::optional<ObjectKey> find_name(std::string_view name) const;
};

/// Reads an EDS or DCF. Tolerant of what vendors do: Windows-1252 text, any case, missing lists and optional
/// keys, misspelt or unknown sections (a warning), comments anywhere. EdsError, with the line, for values
/// that are no numbers, unknown object types and sub-objects without a parent.
ObjectDictionary load_eds(const std::string& path, int node_id);
ObjectDictionary parse_eds(std::string_view text, const std::string& name, int node_id);

/// `value` as the bytes of `type`, little-endian; empty if it does not fit.
std::vector<std::uint8_t> encode_integer(DataType type, std::int64_t value);
std::int64_t decode_integer(DataType type, std::span<const std::uint8_t> bytes);

}  // namespace trn

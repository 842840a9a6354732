#include "hal/can/eds.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstddef>
#include <sstream>

#include "core/letter_case.h"
#include "core/plain_file.h"
#include "hal/can/nmt.h"

namespace trn {

namespace {

struct Line {
  std::string value;
  int number = 0;
};
struct Section {
  std::string name;
  int line = 0;
  std::map<std::string, Line> keys;  // lower case
};

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

bool is_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = static_cast<unsigned char>(text[i++]);
    int more = byte < 0x80 ? 0 : (byte >> 5) == 6 ? 1 : (byte >> 4) == 14 ? 2 : (byte >> 3) == 30 ? 3 : -1;
    if (more < 0) return false;
    for (; more > 0; --more)
      if (i >= text.size() || (static_cast<unsigned char>(text[i++]) & 0xC0) != 0x80) return false;
  }
  return true;
}

// Latin letters and signs of the code page; its 0x80 to 0x9F, which differ from Latin-1, become a question
// mark.
std::string from_windows_1252(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80)
      out += c;
    else if (byte < 0xA0)
      out += byte == 0x80 ? "EUR" : "?";
    else
      out += {static_cast<char>(0xC0 | byte >> 6), static_cast<char>(0x80 | (byte & 0x3F))};
  }
  return out;
}

/// The lines of the file, as sections with keys.
class IniReader {
 public:
  IniReader(std::string_view text, ObjectDictionary& out) : out_(out) {
    // Editors on Windows put a byte order mark in front of UTF-8; it would become part of the first section's
    // name. Text that is no UTF-8 is the code page that most vendors' tools write.
    if (text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);
    const std::string converted = is_utf8(text) ? std::string(text) : from_windows_1252(text);
    std::istringstream in(converted);
    for (std::string line; std::getline(in, line);) take(trimmed(line), ++number_);
  }
  const std::vector<Section>& sections() const { return sections_; }

 private:
  void warn(int line, const std::string& what) {
    if (out_.warnings.size() < 100) out_.warnings.push_back(fmt::format("{}:{}: {}", out_.file, line, what));
  }

  void take(std::string_view line, int number) {
    if (line.empty() || line[0] == ';' || line[0] == '#' || line.substr(0, 2) == "//") return;
    if (line[0] == '[') return open_section(line, number);
    const auto equals = line.find('=');
    if (equals == std::string_view::npos) return warn(number, "neither section nor key=value; left out");
    if (sections_.empty()) return warn(number, "a key in front of the first section; left out");
    std::string_view value = line.substr(equals + 1);
    // The standard has no comment behind a value, many files do.
    if (const auto comment = value.find(';'); comment != std::string_view::npos)
      value = value.substr(0, comment);
    const std::string key = lower_case(trimmed(line.substr(0, equals)));
    const bool fresh = sections_.back().keys.emplace(key, Line{std::string(trimmed(value)), number}).second;
    if (!fresh)
      warn(number, fmt::format("'{}' for the second time in [{}]; left out", key, sections_.back().name));
  }

  void open_section(std::string_view line, int number) {
    const auto end = line.find(']');
    if (end == std::string_view::npos) warn(number, "']' is missing; taken as if it were there");
    sections_.push_back(
        {lower_case(trimmed(line.substr(1, end == std::string_view::npos ? end : end - 1))), number, {}});
  }

  ObjectDictionary& out_;
  std::vector<Section> sections_;
  int number_ = 0;
};

/// Sections to objects.
class DictionaryReader {
 public:
  DictionaryReader(ObjectDictionary& out, int node_id) : out_(out), node_id_(node_id) {}

  void take(const Section& section) {
    std::uint16_t index = 0;
    std::string_view rest;
    if (split_index(section.name, index, rest)) return take_object(section, index, rest);
    if (section.name == "deviceinfo") {
      out_.vendor = text(section, "vendorname");
      out_.product = text(section, "productname");
      return;
    }
    if (section.name == "devicecomissioning" || section.name == "devicecommissioning") {
      // The standard itself spells the section with one m (CiA 306-1), some tools with two. Only a DCF, which
      // belongs to one node, has it.
      const auto id = number_within(section, "nodeid", {0, kNodeIdMax});
      if (id && *id > 0) out_.node_id = static_cast<int>(*id);
      return;
    }
    static const std::vector<std::string> kKnown = {
        "fileinfo",          "deviceinfo",       "dummyusage",          "comments",
        "mandatoryobjects",  "optionalobjects",  "manufacturerobjects", "tools",
        "standarddatatypes", "supportedmodules", "dynamicchannels"};
    if (std::find(kKnown.begin(), kKnown.end(), section.name) != kKnown.end()) return;
    warn(section.line, fmt::format("section [{}] is not known; left out", section.name));
  }

 private:
  [[noreturn]] void fail(int line, const std::string& what) const {
    throw EdsError(fmt::format("{}:{}: {}", out_.file, line, what));
  }
  void warn(int line, const std::string& what) {
    if (out_.warnings.size() < 100) out_.warnings.push_back(fmt::format("{}:{}: {}", out_.file, line, what));
  }

  // "1018", "0x1018", "1018sub1", "1018 Sub 1": four hex digits, then what belongs to the object
  static bool split_index(std::string_view name, std::uint16_t& index, std::string_view& rest) {
    if (name.substr(0, 2) == "0x") name.remove_prefix(2);
    if (name.size() < 4) return false;
    const auto [end, error] = std::from_chars(name.data(), name.data() + 4, index, 16);
    rest = trimmed(name.substr(4));
    return error == std::errc() && end == name.data() + 4;
  }

  static std::string text(const Section& section, const std::string& key) {
    const auto found = section.keys.find(key);
    return found == section.keys.end() ? "" : found->second.value;
  }

  // C notation (0x.., decimal, octal with a leading 0 is not in use), with $NODEID added
  std::optional<std::int64_t> number(const Section& section, const std::string& key) const {
    const auto found = section.keys.find(key);
    if (found == section.keys.end() || found->second.value.empty()) return std::nullopt;
    std::string value = lower_case(found->second.value);
    std::erase_if(value, [](char c) { return c == ' ' || c == '\t'; });
    std::int64_t sum = 0;
    for (std::size_t i = 0; i <= value.size();) {
      const std::size_t plus = std::min(value.find('+', i), value.size());
      const std::string term = value.substr(i, plus - i);
      i = plus + 1;
      // Identifiers of the predefined connection set are written as $NODEID+0x180, in any order of the terms.
      const std::int64_t summand = term == "$nodeid" ? node_id_ : integer(term, found->second);
      if (__builtin_add_overflow(sum, summand, &sum)) fail_number(found->second);
    }
    return sum;
  }

  struct Limits {
    std::int64_t low, high;
  };
  std::optional<std::int64_t> number_within(const Section& section, const std::string& key,
                                            Limits legal) const {
    const std::optional<std::int64_t> value = number(section, key);
    if (value && (*value < legal.low || *value > legal.high))
      fail(section.keys.at(key).number,
           fmt::format("{} {}; legal: {} to {}", key, *value, legal.low, legal.high));
    return value;
  }

  std::int64_t integer(std::string_view term, const Line& line) const {
    const bool negative = !term.empty() && term[0] == '-';
    std::string_view digits = negative ? term.substr(1) : term;
    const bool hex = digits.substr(0, 2) == "0x";
    if (hex) digits.remove_prefix(2);
    std::uint64_t value = 0;
    const auto [end, error] =
        std::from_chars(digits.data(), digits.data() + digits.size(), value, hex ? 16 : 10);
    constexpr std::uint64_t kLeast = std::uint64_t{1} << 63;
    if (error != std::errc() || end != digits.data() + digits.size() || digits.empty() ||
        (negative && value > kLeast))
      fail_number(line);
    // Without a sign all 64 bits may be used, as those of an unsigned value.
    return static_cast<std::int64_t>(negative ? 0 - value : value);
  }

  [[noreturn]] void fail_number(const Line& line) const {
    fail(line.number, fmt::format("'{}' is no number; legal: 123, -5, 0x1F, $NODEID+0x180", line.value));
  }

  void take_object(const Section& section, std::uint16_t index, std::string_view rest) {
    if (rest.empty()) return take_entry(section, {index, 0}, true);
    if (rest.substr(0, 3) != "sub") {  // 1018Name, 1003Value: compact lists of CiA 306-1, 4.6.3
      if (rest != "name" && rest != "value" && rest != "objectlinks" && rest != "denotation")
        warn(section.line, fmt::format("section [{}] is not known; left out", section.name));
      return;
    }
    unsigned sub = 0;
    const std::string_view digits = trimmed(rest.substr(3));
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), sub, 16);
    if (error != std::errc() || end != digits.data() + digits.size() || sub > 255)
      fail(section.line, fmt::format("[{}]: after 'sub' comes a number, 0 to FF", section.name));
    if (parents_.find(index) == parents_.end())
      warn(section.line, fmt::format("[{}] comes without [{:04X}] in front of it", section.name, index));
    take_entry(section, {index, static_cast<std::uint8_t>(sub)}, false);
  }

  void take_entry(const Section& section, ObjectKey key, bool top) {
    DictionaryEntry entry;
    entry.name = text(section, "parametername");
    entry.line = section.line;
    // An object without ObjectType is a variable (7) by CiA 306-1.
    const std::int64_t object_type = number(section, "objecttype").value_or(7);
    if (object_type < 2 || object_type > 9)
      fail(section.line,
           fmt::format("[{}]: ObjectType {} is not known; legal: 7 (variable), 8 (array), 9 (record)",
                       section.name, object_type));
    if (top) parents_[key.index] = entry.name;
    fill_value(section, entry);
    // An array or a record has no value of its own: its values are its sub-objects, which follow as sections
    // or, in a compact file, are made here.
    const bool list = top && (object_type == 8 || object_type == 9);
    if (list || key.sub != 0) mend_limits(section, key, entry);
    if (list) return add_compact(section, key, entry);
    if (!top) entry.name = parents_[key.index] + ": " + entry.name;
    out_.entries[key] = entry;
  }

  // 0x1016 holds a node id above a time of 16 bits. Several makers' files have a limit of the time alone.
  void mend_limits(const Section& section, ObjectKey key, DictionaryEntry& entry) {
    if (key.index != 0x1016 || !entry.high || *entry.high > 0xFFFF || entry.high == 0) return;
    warn(section.line, fmt::format("HighLimit {} of [{}] leaves no room for a node id; left out", *entry.high,
                                   section.name));
    entry.high.reset();
  }

  void fill_value(const Section& section, DictionaryEntry& entry) {
    const std::int64_t type = number_within(section, "datatype", {0, 0xFFFF}).value_or(0);
    entry.type = static_cast<DataType>(type);
    const std::string access = lower_case(text(section, "accesstype"));
    entry.writable = access == "rw" || access == "wo" || access == "rww" || access == "rwr";
    entry.readable = access != "wo";
    if (!access.empty() && !entry.writable && access != "ro" && access != "const" && access != "wo")
      warn(section.line, fmt::format("AccessType '{}' is not known; taken as ro", access));
    entry.mappable = number(section, "pdomapping").value_or(0) != 0;
    // Limits of real numbers would need their own decoding, and nothing here asks for them.
    const bool real = entry.type == DataType::kReal32 || entry.type == DataType::kReal64;
    if (!real && bits_of(entry.type) != 0) {
      entry.low = number(section, "lowlimit");
      entry.high = number(section, "highlimit");
    }
    // DefaultValue is what the device powers up with, ParameterValue what the configuration tool of a DCF
    // set. The two are kept apart, since only the second is written to the drive.
    entry.value = encoded(section, "defaultvalue", entry.type);
    if (!text(section, "parametervalue").empty())
      entry.configured = encoded(section, "parametervalue", entry.type);
  }

  std::vector<std::uint8_t> encoded(const Section& section, const std::string& key, DataType type) const {
    const std::string words = text(section, key);
    if (bits_of(type) == 0) return {words.begin(), words.end()};
    if (type == DataType::kReal32 || type == DataType::kReal64) return encoded_real(section, key, type);
    const std::int64_t value = number(section, key).value_or(0);
    std::vector<std::uint8_t> bytes = encode_integer(type, value);
    if (bytes.empty())
      fail(section.keys.at(key).number, fmt::format("{} does not fit into {} bits", value, bits_of(type)));
    return bytes;
  }

  // IEEE 754, little-endian (CiA 301, 7.1.4.5)
  std::vector<std::uint8_t> encoded_real(const Section& section, const std::string& key,
                                         DataType type) const {
    const std::string words = text(section, key);
    double value = 0;
    const auto [end, error] = std::from_chars(words.data(), words.data() + words.size(), value);
    if (!words.empty() && (error != std::errc() || end != words.data() + words.size()))
      fail(section.keys.at(key).number, fmt::format("'{}' is no number; legal: 1.5, -2e3", words));
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(bits_of(type) / 8));
    put_le(bytes.data(), static_cast<int>(bytes.size()),
           type == DataType::kReal64 ? std::bit_cast<std::uint64_t>(value)
                                     : std::bit_cast<std::uint32_t>(static_cast<float>(value)));
    return bytes;
  }

  // CompactSubObj=n: sub-objects 1 to n like the parent, sub-object 0 their number (CiA 306-1, 4.6.3)
  void add_compact(const Section& section, ObjectKey key, DictionaryEntry entry) {
    const std::int64_t count = number_within(section, "compactsubobj", {0, 254}).value_or(0);
    if (count == 0) return;
    DictionaryEntry zero;
    zero.name = entry.name;
    zero.type = DataType::kUnsigned8;
    zero.value = {static_cast<std::uint8_t>(count)};
    zero.line = entry.line;
    out_.entries[key] = zero;
    for (std::int64_t sub = 1; sub <= count; ++sub)
      out_.entries[{key.index, static_cast<std::uint8_t>(sub)}] = entry;
  }

  ObjectDictionary& out_;
  int node_id_;
  std::map<std::uint16_t, std::string> parents_;
};

}  // namespace

int bits_of(DataType type) {
  switch (type) {
    case DataType::kBoolean:
    case DataType::kInteger8:
    case DataType::kUnsigned8:
      return 8;
    case DataType::kInteger16:
    case DataType::kUnsigned16:
      return 16;
    case DataType::kInteger32:
    case DataType::kUnsigned32:
    case DataType::kReal32:
      return 32;
    case DataType::kReal64:
    case DataType::kInteger64:
    case DataType::kUnsigned64:
      return 64;
    default:
      return 0;
  }
}

bool is_signed(DataType type) {
  return type == DataType::kInteger8 || type == DataType::kInteger16 || type == DataType::kInteger32 ||
         type == DataType::kInteger64;
}

std::vector<std::uint8_t> encode_integer(DataType type, std::int64_t value) {
  const int bits = bits_of(type);
  if (bits == 0) return {};
  if (bits < 64) {
    const std::int64_t low = is_signed(type) ? -(std::int64_t{1} << (bits - 1)) : 0;
    const std::int64_t high = (std::int64_t{1} << (is_signed(type) ? bits - 1 : bits)) - 1;
    // data sheets write negative numbers as 0xFFFF.. too
    const bool wrapped = is_signed(type) && value > high && value < (std::int64_t{1} << bits);
    if ((value < low || value > high) && !wrapped) return {};
  }
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(bits / 8));
  put_le(bytes.data(), bits / 8, static_cast<std::uint64_t>(value));
  return bytes;
}

std::int64_t decode_integer(DataType type, std::span<const std::uint8_t> bytes) {
  const int size = static_cast<int>(std::min<std::size_t>(bytes.size(), 8));
  if (size == 0) return 0;
  if (is_signed(type)) return get_le_signed(bytes.data(), size);
  return static_cast<std::int64_t>(get_le(bytes.data(), size));
}

const DictionaryEntry* ObjectDictionary::find(ObjectKey key) const {
  const auto found = entries.find(key);
  return found == entries.end() ? nullptr : &found->second;
}

std::string ObjectDictionary::name_of(ObjectKey key) const {
  const DictionaryEntry* entry = find(key);
  return entry ? entry->name : "";
}

std::optional<std::int64_t> ObjectDictionary::integer(ObjectKey key) const {
  const DictionaryEntry* entry = find(key);
  if (!entry || bits_of(entry->type) == 0) return std::nullopt;
  return decode_integer(entry->type, entry->value);
}

std::optional<ObjectKey> ObjectDictionary::find_name(std::string_view name) const {
  for (const auto& [key, entry] : entries)
    if (lower_case(entry.name) == lower_case(name)) return key;
  return std::nullopt;
}

ObjectDictionary parse_eds(std::string_view text, const std::string& name, int node_id) {
  ObjectDictionary out;
  out.file = name;
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
    throw EdsError(fmt::format("{}:1: this is UTF-16; save the file as UTF-8 or ANSI", name));
  const IniReader ini(text, out);
  DictionaryReader reader(out, node_id);
  for (const Section& section : ini.sections()) reader.take(section);
  if (out.entries.empty())
    throw EdsError(
        fmt::format("{}:1: no object in this file; an EDS has sections like [1000] (CiA 306-1)", name));
  return out;
}

ObjectDictionary load_eds(const std::string& path, int node_id) {
  constexpr std::size_t kBytesMax = std::size_t{16} << 20;
  std::string text;
  try {
    text = read_plain_file(path, kBytesMax);
  } catch (const PlainFileError& error) {
    throw EdsError(fmt::format("{}:1: {}", path.c_str(), error.what()));
  }
  return parse_eds(text, path, node_id);
}

}  // namespace trn

#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "app/import/import_place.h"
#include "app/import/ini_file.h"

namespace trn {

/// Reads the numbers of one section in mm or degrees, by the joint's kind.
struct JointSection {
  const IniFile& ini;
  std::string name;
  double unit;

  std::optional<double> length(std::string_view key) const {
    const std::optional<double> value = ini.number(name, key);
    return value ? std::optional(*value * unit) : std::nullopt;
  }
  bool is_there() const { return ini.has_section(name); }
  /// Of the key's value, or of the section if it has no such key.
  ImportPlace place(std::string_view key) const {
    const IniEntry* entry = ini.find(name, key);
    return entry ? entry->value_place : ini.place_of(name);
  }
};

}  // namespace trn

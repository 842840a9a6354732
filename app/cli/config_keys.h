#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/cli/config_meanings.h"
#include "app/cli/config_specimens.h"
#include "core/config.h"
#include "core/config_record.h"

namespace trn {

/// A key of a table, as its readers ask for it in all specimens.
struct ConfigKey {
  AskedKey::Form form = AskedKey::Form::kPresence;
  bool required = false;                               ///< wherever it is asked for
  bool at_times = false;                               ///< some tables of this place are not asked for it
  bool fallback_varies = false, legal_varies = false;  ///< they follow from other keys
  std::string fallback;                                ///< as a config spells it; "" without one
  Range range;
  std::vector<std::string> choices;
};

/// A table in which keys are legal.
struct ConfigTableKeys {
  bool required = false, is_array = false;
  std::map<std::string, ConfigKey> keys;
};

/// Table ("drives.node") and the type around it ("canopen").
using ConfigPlaceName = std::pair<std::string, std::string>;

/// Everything that is legal in a config, and what it means.
struct ConfigKeys {
  std::map<ConfigPlaceName, ConfigTableKeys> tables;

  /// The places that a section speaks of, in its order; type "*" stands for every type that there is.
  std::vector<ConfigPlaceName> places(const SectionMeaning& section) const;
  /// A key as the section's places together have it; nothing if none has.
  std::optional<ConfigKey> find(const SectionMeaning& section, const std::string& key) const;
  /// Where readers and meanings do not agree, a sentence each; empty: they do.
  std::vector<std::string> check() const;
};

ConfigKeys gather_keys(const std::vector<AskedSpecimen>& specimens);

/// The keys that a meaning is for.
std::vector<std::string> split_keys(std::string_view keys);
/// The unit that a key's name says, as "mm/s²"; "" without one.
std::string unit_of_key(std::string_view key);

}  // namespace trn

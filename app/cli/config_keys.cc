#include "app/cli/config_keys.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>

namespace trn {

namespace {

using Form = AskedKey::Form;

/// A key as one table of one specimen was asked for it, by whichever readers.
struct Questions {
  Form form = Form::kPresence;
  bool required = true;
  std::set<std::string> fallbacks;
  std::set<std::pair<double, double>> ranges;
  std::set<std::vector<std::string>> choices;
};
using TableQuestions = std::map<std::string, Questions>;

bool is_table(Form form) { return form == Form::kTable || form == Form::kTables; }

/// The table's name without the numbers of its entries: "drives.node[1]" -> "drives.node".
std::string without_numbers(const std::string& table) {
  std::string out;
  bool inside = false;
  for (const char c : table) {
    if (c == '[') inside = true;
    if (!inside) out += c;
    if (c == ']') inside = false;
  }
  return out;
}

// A choice is read as a text, three numbers as numbers; what was asked for by a narrower form stands last in
// the enumeration.
void add(const AskedKey& asked, Questions& out) {
  out.form = std::max(out.form, asked.form);
  out.required = out.required && asked.required;
  if (!asked.fallback.empty()) out.fallbacks.insert(asked.fallback);
  if (asked.form == Form::kNumber || asked.form == Form::kWholeNumber)
    out.ranges.insert({asked.min, asked.max});
  if (!asked.choices.empty()) out.choices.insert(asked.choices);
}

/// All that was asked for at one place: table by table.
using PlaceQuestions = std::vector<TableQuestions>;

ConfigKey summary(const std::string& name, const PlaceQuestions& tables) {
  ConfigKey key;
  Questions all;
  bool optional_somewhere = false, required_somewhere = false;
  for (const TableQuestions& table : tables) {
    const auto found = table.find(name);
    if (found == table.end()) {
      key.at_times = true;
      continue;
    }
    const Questions& q = found->second;
    all.form = std::max(all.form, q.form);
    (q.required ? required_somewhere : optional_somewhere) = true;
    all.fallbacks.insert(q.fallbacks.begin(), q.fallbacks.end());
    all.ranges.insert(q.ranges.begin(), q.ranges.end());
    all.choices.insert(q.choices.begin(), q.choices.end());
  }
  key.form = all.form;
  key.required = required_somewhere && !optional_somewhere;
  key.fallback_varies = all.fallbacks.size() > 1 || (required_somewhere && optional_somewhere);
  key.legal_varies = all.ranges.size() > 1 || all.choices.size() > 1;
  if (!key.fallback_varies && !all.fallbacks.empty()) key.fallback = *all.fallbacks.begin();
  if (!key.legal_varies && !all.ranges.empty())
    key.range = {all.ranges.begin()->first, all.ranges.begin()->second};
  if (!key.legal_varies && !all.choices.empty()) key.choices = *all.choices.begin();
  return key;
}

std::string place_text(const ConfigPlaceName& place) {
  return place.second.empty() ? fmt::format("[{}]", place.first)
                              : fmt::format("[{}] of type {}", place.first, place.second);
}

/// Two places of one section: what differs between them varies.
void join(const ConfigKey& other, ConfigKey& out) {
  out.fallback_varies |=
      other.fallback_varies || other.fallback != out.fallback || other.required != out.required;
  out.legal_varies |= other.legal_varies || other.form != out.form || other.choices != out.choices ||
                      other.range.min != out.range.min || other.range.max != out.range.max;
  out.at_times |= other.at_times;
  if (out.fallback_varies) out.fallback.clear();
}

/// A section's key with its meaning: words are there where the readers cannot say it, and nowhere else.
void check_words(const std::string& name, const ConfigKey& key, const KeyMeaning& meaning,
                 std::string_view section, std::vector<std::string>& errors) {
  const auto tell = [&](std::string_view what) {
    errors.push_back(fmt::format("section '{}': '{}' {}", section, name, what));
  };
  const bool alone = split_keys(meaning.keys).size() == 1;
  const bool follows = key.fallback_varies || (key.required && key.at_times && alone);
  const bool fixed = key.required ? !key.at_times : !key.fallback.empty();
  if (follows && meaning.fallback.empty())
    tell("has a default that follows from other keys; say it in words");
  if (!follows && fixed && !meaning.fallback.empty())
    tell("has a fixed default and words for it; drop the words");
  if (key.legal_varies && meaning.legal.empty())
    tell("has a range or choices that follow from other keys; say them in words");
  if (key.form == Form::kPresence) tell("is looked for, but no specimen has it; add it to one");
  if (meaning.meaning.empty()) tell("has no meaning");
}

using MeantKeys = std::set<std::pair<ConfigPlaceName, std::string>>;

void check_meaning(const ConfigKeys& keys, const SectionMeaning& section, const KeyMeaning& meaning,
                   MeantKeys& meant, std::vector<std::string>& errors) {
  const std::vector<std::string> names = split_keys(meaning.keys);
  for (const std::string& name : names)
    if (const auto key = keys.find(section, name))
      check_words(name, *key, meaning, section.title, errors);
    else
      errors.push_back(
          fmt::format("section '{}': '{}' has a meaning, but no reader asks for it", section.title, name));
  for (const ConfigPlaceName& place : keys.places(section)) {
    bool asked = false;
    for (const std::string& name : names) {
      if (!keys.tables.at(place).keys.contains(name)) continue;
      asked = true;
      if (!meant.insert({place, name}).second)
        errors.push_back(fmt::format("{}: '{}' has two meanings", place_text(place), name));
    }
    if (!asked)
      errors.push_back(fmt::format("{}: '{}' has a meaning, but no reader asks for it there",
                                   place_text(place), meaning.keys));
  }
}

}  // namespace

std::vector<std::string> split_keys(std::string_view keys) {
  std::istringstream in{std::string(keys)};
  std::vector<std::string> out;
  for (std::string key; in >> key;) out.push_back(key);
  return out;
}

std::string unit_of_key(std::string_view key) {
  static constexpr std::pair<std::string_view, std::string_view> kUnits[] = {{"counts_per_mm", "counts/mm"},
                                                                             {"counts_per_deg", "counts/°"},
                                                                             {"per_K", "1/K"},
                                                                             {"per_s", "1/s"},
                                                                             {"mm_s2_A", "mm/s²/A"},
                                                                             {"W_m2K", "W/(m² K)"},
                                                                             {"mm_s3", "mm/s³"},
                                                                             {"deg_s3", "°/s³"},
                                                                             {"mm_s2", "mm/s²"},
                                                                             {"deg_s2", "°/s²"},
                                                                             {"rpm_s", "rpm/s"},
                                                                             {"deg_s", "°/s"},
                                                                             {"mm_s", "mm/s"},
                                                                             {"um_s", "µm/s"},
                                                                             {"N_mm", "N/mm"},
                                                                             {"K_s", "K/s"},
                                                                             {"N_s", "N/s"},
                                                                             {"1_s", "1/s"},
                                                                             {"arcsec", "arcsec"},
                                                                             {"periods", "periods"},
                                                                             {"rpm", "rpm"},
                                                                             {"deg", "°"},
                                                                             {"mm", "mm"},
                                                                             {"ms", "ms"},
                                                                             {"hz", "Hz"},
                                                                             {"kg", "kg"},
                                                                             {"C", "°C"},
                                                                             {"K", "K"},
                                                                             {"N", "N"},
                                                                             {"A", "A"},
                                                                             {"s", "s"}};
  for (const std::string_view end : {"_min", "_max"})
    if (key.ends_with(end)) key.remove_suffix(end.size());
  for (const auto& [suffix, unit] : kUnits)
    if (key == suffix || (key.ends_with(suffix) && key[key.size() - suffix.size() - 1] == '_'))
      return std::string(unit);
  return "";
}

ConfigKeys gather_keys(const std::vector<AskedSpecimen>& specimens) {
  std::map<ConfigPlaceName, PlaceQuestions> places;
  for (const AskedSpecimen& specimen : specimens) {
    std::map<std::pair<std::string, ConfigPlaceName>, TableQuestions> tables;  // by their numbered names
    for (const AskedKey& asked : specimen.record.asked)
      add(asked, tables[{asked.table, {without_numbers(asked.table), asked.kind}}][asked.key]);
    for (auto& [name, table] : tables) places[name.second].push_back(std::move(table));
  }
  ConfigKeys out;
  std::map<std::string, ConfigKey> children;
  for (const auto& [place, tables] : places) {
    std::set<std::string> names;
    for (const TableQuestions& table : tables)
      for (const auto& [name, questions] : table) names.insert(name);
    for (const std::string& name : names) {
      const ConfigKey key = summary(name, tables);
      if (!is_table(key.form))
        out.tables[place].keys[name] = key;
      else
        children[place.first.empty() ? name : place.first + "." + name] = key;
    }
  }
  for (auto& [place, table] : out.tables) {
    const auto found = children.find(place.first);
    if (found == children.end()) continue;
    table.required = found->second.required;
    table.is_array = found->second.form == Form::kTables;
  }
  return out;
}

std::vector<ConfigPlaceName> ConfigKeys::places(const SectionMeaning& section) const {
  std::vector<ConfigPlaceName> out;
  for (const ConfigPlace& place : section.places)
    for (const auto& [name, table] : tables)
      if (name.first == place.table && (place.kind == "*" || place.kind == name.second)) out.push_back(name);
  return out;
}

std::optional<ConfigKey> ConfigKeys::find(const SectionMeaning& section, const std::string& key) const {
  std::optional<ConfigKey> out;
  for (const ConfigPlaceName& place : places(section)) {
    const auto& keys = tables.at(place).keys;
    const auto found = keys.find(key);
    if (found == keys.end()) continue;
    if (out)
      join(found->second, *out);
    else
      out = found->second;
  }
  return out;
}

std::vector<std::string> ConfigKeys::check() const {
  std::vector<std::string> errors;
  std::set<std::pair<ConfigPlaceName, std::string>> meant;
  for (const ChapterMeaning* chapter : all_meanings())
    for (const SectionMeaning& section : chapter->sections)
      for (const KeyMeaning& meaning : section.keys) check_meaning(*this, section, meaning, meant, errors);
  for (const auto& [place, table] : tables)
    for (const auto& [name, key] : table.keys)
      if (!meant.contains({place, name}))
        errors.push_back(fmt::format("{}: '{}' has no meaning; add it to app/cli/config_meanings*.cc",
                                     place_text(place), name));
  return errors;
}

}  // namespace trn

#include "app/cli/config_page.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/cli/config_meanings.h"
#include "core/config_record.h"
#include "core/letter_case.h"

namespace trn {

namespace {

using Form = AskedKey::Form;

constexpr const char kHead[] = R"(# The config of a machine

A machine is one file in [TOML](https://toml.io): its joints, how they carry tool and work, its drives, and what corrects
them. This page lists every key. A small machine needs no more than this:

```toml
[machine]
name = "mill"
period_s = 0.001

[[joint]]                     # and the same for Y and Z
name = "X"
type = "linear"
min_mm = -300.0
max_mm = 300.0
velocity_mm_s = 500.0
acceleration_mm_s2 = 5000.0
jerk_mm_s3 = 100000.0

[kinematics]
type = "serial"

[[kinematics.tool_branch]]    # and the same for Y and Z
joint = "X"
direction = [1.0, 0.0, 0.0]

[drives]
type = "simulated"
```

`[name]` begins a table that is there once, `[[name]]` one entry of a list of tables. `configs/` has a whole file for every
kind of machine; copy the nearest one. A key's name ends in its unit: `_mm`, `_deg`, `_s`, `_mm_s2` (mm/s²) and so on.
Files that a config names lie beside it, or where their whole path says.

The reader is strict. An unknown key, a missing key, a wrong type and a value out of range are errors. Nothing moves, and the
exit code is 3. An error names file, line and column, and the nearest legal key:

```
mill.toml:3:1: unknown key 'machine.periode_s'; did you mean 'period_s'?
mill.toml:3:12: 'machine.period_s' = 5 is out of range: 1e-05 to 0.1 is legal
mill.toml:27:11: 'kinematics.tool_branch[0].joint' = "x" is not legal; did you mean "X"? Legal: X, Y, Z
```

No number may be above 1e15, and none that must be above 0 may be below 1e-12. A text has at most 1000 bytes, all of them
printable. An entry that stands there twice, as two tables for the same joint, is an error as well.

In the tables below, "required" means that a key must be there wherever its table is, and a table wherever the one around it
is. The word "none" means that a key may be missing and has no default. A table that is "under" a type is legal where the table around
it has that `type`.
`trunnion config --keys` writes this page from what the readers themselves ask for, and a test compares the two;
`trunnion config --keys --json` has the same for programs.

**An editor that knows the keys.** An editor with [taplo](https://taplo.tamasfe.dev/), such as VS Code with the extension Even Better TOML, completes keys,
shows what they mean, and marks what is wrong. It needs a schema, which the Debian package installs. From a build,
`trunnion config --schema > machine.schema.json` writes it. The first line of the config names it:

```toml
#:schema file:///usr/share/trunnion/machine.schema.json
```

`taplo check mill.toml` does the same in a terminal. The schema knows each key alone; what depends on several of them is
told by `trunnion run --machine mill.toml`.
)";

bool is_numeric(Form form) { return form == Form::kNumber || form == Form::kWholeNumber; }
std::string number_text(double value) { return fmt::format("{:.12g}", value); }

std::string range_text(Range range) {
  const bool low = std::isfinite(range.min), high = std::isfinite(range.max);
  if (low && high) return fmt::format("{} to {}", number_text(range.min), number_text(range.max));
  if (high) return fmt::format("{} or less", number_text(range.max));
  if (!low) return "";
  return range.min == kPositive.min ? "above 0" : fmt::format("{} or more", number_text(range.min));
}

std::string form_text(const ConfigKey& key) {
  const std::string range = is_numeric(key.form) ? range_text(key.range) : "";
  switch (key.form) {
    case Form::kNumber:
      return range.empty() ? "number" : range;
    case Form::kWholeNumber:
      return range.empty() ? "whole number" : "whole number, " + range;
    case Form::kBoolean:
      return "`true` or `false`";
    case Form::kChoice:
      return fmt::format("`\"{}\"`", fmt::join(key.choices, "\"`, `\""));
    case Form::kNumbers:
      return "list of numbers";
    case Form::kThreeNumbers:
      return "three numbers";
    case Form::kTexts:
      return "list of texts";
    default:
      return "text";
  }
}

std::string legal_text(const ConfigKey& key, const KeyMeaning& meaning) {
  if (key.legal_varies) return std::string(meaning.legal);
  if (meaning.legal.empty()) return form_text(key);
  return fmt::format("{}{} {}", form_text(key), is_numeric(key.form) ? "," : ":", meaning.legal);
}

std::string fallback_text(const ConfigKey& key, const KeyMeaning& meaning) {
  if (!meaning.fallback.empty()) return std::string(meaning.fallback);
  if (key.required) return "required";
  return key.fallback.empty() ? "none" : fmt::format("`{}`", key.fallback);
}

/// One line for each key, or one for all where they are the same.
std::string cell(std::vector<std::string> lines) {
  if (std::adjacent_find(lines.begin(), lines.end(), std::not_equal_to<>()) == lines.end()) lines.resize(1);
  std::string text = fmt::format("{}", fmt::join(lines, "<br>"));
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) text.insert(at, "\\");
  return text;
}

std::string row(const ConfigKeys& keys, const SectionMeaning& section, const KeyMeaning& meaning) {
  std::vector<std::string> names, units, legal, fallbacks;
  for (const std::string& name : split_keys(meaning.keys)) {
    const ConfigKey key = keys.find(section, name).value_or(ConfigKey{});
    names.push_back(fmt::format("`{}`", name));
    units.push_back(unit_of_key(name));
    legal.push_back(legal_text(key, meaning));
    fallbacks.push_back(fallback_text(key, meaning));
  }
  return fmt::format("| {} | {} | {} | {} | {} |\n", cell(names), cell(legal), cell(units), cell(fallbacks),
                     cell({std::string(meaning.meaning)}));
}

/// A table's header with the types that it is legal with.
struct Header {
  std::string text;
  std::vector<std::string> types;
  bool own_type = false;  ///< the type is a key of this very table
  bool required = false;
};

std::vector<Header> headers_of(const ConfigKeys& keys, const SectionMeaning& section) {
  std::vector<Header> out;
  for (const ConfigPlace& place : section.places)
    for (const ConfigPlaceName& name : keys.places({"", {place}, "", {}})) {
      const ConfigTableKeys& table = keys.tables.at(name);
      const std::string text = fmt::format(fmt::runtime(table.is_array ? "`[[{}]]`" : "`[{}]`"), name.first);
      if (out.empty() || out.back().text != text)
        out.push_back({text, {}, table.keys.contains("type"), table.required});
      if (place.kind != "*" && !name.second.empty()) out.back().types.push_back(name.second);
    }
  return out;
}

/// "`[[drives.node]]` under `type = "canopen"`, required" for each table that the section is about.
std::string headers_text(const std::vector<Header>& headers) {
  const bool alike = std::all_of(headers.begin(), headers.end(),
                                 [&](const Header& h) { return h.required == headers[0].required; });
  std::vector<std::string> out;
  for (const Header& header : headers) {
    std::string text = header.text;
    if (!header.types.empty())
      text += fmt::format(" {} `type = \"{}\"`", header.own_type ? "with" : "under",
                          fmt::join(header.types, "\"` or `\""));
    const bool tells = !alike || &header == &headers.back();
    out.push_back(text + (tells ? header.required ? ", required" : ", optional" : ""));
  }
  return fmt::format("{}.", fmt::join(out, "; "));
}

std::string section_text(const ConfigKeys& keys, const SectionMeaning& section) {
  std::string out = section.title.empty() ? "\n" : fmt::format("\n### {}\n\n", section.title);
  out += fmt::format("{}{}{}\n\n", headers_text(headers_of(keys, section)), section.intro.empty() ? "" : " ",
                     section.intro);
  out += "| key | legal | unit | default | meaning |\n|---|---|---|---|---|\n";
  for (const KeyMeaning& meaning : section.keys) out += row(keys, section, meaning);
  return out;
}

/// As GitHub makes an anchor of a heading.
std::string anchor(std::string_view title) {
  std::string out;
  for (const char c : title) {
    if (c == ' ') out += '-';
    if (std::isalnum(static_cast<unsigned char>(c))) out += lower_case(c);
  }
  return out;
}

const char* form_name(Form form) {
  switch (form) {
    case Form::kNumber:
      return "number";
    case Form::kWholeNumber:
      return "integer";
    case Form::kBoolean:
      return "boolean";
    case Form::kChoice:
      return "choice";
    case Form::kNumbers:
      return "numbers";
    case Form::kThreeNumbers:
      return "three_numbers";
    case Form::kTexts:
      return "texts";
    default:
      return "text";
  }
}

nlohmann::ordered_json key_json(const std::string& name, const ConfigKey& key, const KeyMeaning& meaning) {
  nlohmann::ordered_json out = {{"key", name}, {"form", form_name(key.form)}};
  if (const std::string unit = unit_of_key(name); !unit.empty()) out["unit"] = unit;
  out["required"] = key.required && !key.at_times && !key.fallback_varies;
  if (const auto names = split_keys(meaning.keys); key.required && key.at_times && names.size() > 1)
    out["one_of"] = names;
  if (!key.fallback.empty()) out["default"] = nlohmann::ordered_json::parse(key.fallback);
  if (!meaning.fallback.empty()) out["default_in_words"] = meaning.fallback;
  if (is_numeric(key.form) && !key.legal_varies) {
    if (std::isfinite(key.range.min))
      out[key.range.min == kPositive.min ? "above" : "min"] =
          key.range.min == kPositive.min ? 0.0 : key.range.min;
    if (std::isfinite(key.range.max)) out["max"] = key.range.max;
  }
  if (!key.choices.empty()) out["choices"] = key.choices;
  if (!meaning.legal.empty()) out["legal_in_words"] = meaning.legal;
  out["meaning"] = meaning.meaning;
  return out;
}

}  // namespace

std::string config_page(const ConfigKeys& keys) {
  std::string out = kHead;
  out += "\n";
  for (const ChapterMeaning* chapter : all_meanings())
    out += fmt::format("- [{}](#{})\n", chapter->title, anchor(chapter->title));
  for (const ChapterMeaning* chapter : all_meanings()) {
    out += fmt::format("\n## {}\n", chapter->title);
    if (!chapter->intro.empty()) out += fmt::format("\n{}\n", chapter->intro);
    for (const SectionMeaning& section : chapter->sections) out += section_text(keys, section);
  }
  return out;
}

nlohmann::ordered_json config_json(const ConfigKeys& keys) {
  std::map<ConfigPlaceName, nlohmann::ordered_json> meant;
  std::vector<ConfigPlaceName> order;
  for (const ChapterMeaning* chapter : all_meanings())
    for (const SectionMeaning& section : chapter->sections)
      for (const ConfigPlaceName& place : keys.places(section)) {
        if (!meant.contains(place)) order.push_back(place);
        for (const KeyMeaning& meaning : section.keys)
          for (const std::string& name : split_keys(meaning.keys)) {
            const auto& table = keys.tables.at(place).keys;
            if (const auto found = table.find(name); found != table.end())
              meant[place].push_back(key_json(name, found->second, meaning));
          }
      }
  nlohmann::ordered_json tables = nlohmann::ordered_json::array();
  for (const ConfigPlaceName& place : order) {
    const ConfigTableKeys& table = keys.tables.at(place);
    tables.push_back({{"table", place.first},
                      {"type", place.second},
                      {"array", table.is_array},
                      {"required", table.required},
                      {"keys", meant[place]}});
  }
  return {{"tables", tables}};
}

}  // namespace trn

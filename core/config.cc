#include "core/config.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>

#include "core/config_record.h"
#include "core/config_text.h"
#include "core/letter_case.h"
#include "core/plain_file.h"
#include "core/utf8.h"

namespace trn {

struct ConfigTable::Node {
  std::shared_ptr<const toml::table> document;  // keeps the nodes alive
  const toml::table* table = nullptr;
  std::string file;
  std::string path;  // dotted, for messages
  std::vector<std::string> known;
  std::map<std::string, std::vector<std::shared_ptr<Node>>, std::less<>> children;
  std::string kind;                      // as AskedKey::kind
  std::shared_ptr<ConfigRecord> record;  // most often null: nobody wants to know
};

namespace {

using Node = ConfigTable::Node;
using Form = AskedKey::Form;

std::size_t edit_distance(std::string_view spelt_a, std::string_view spelt_b) {
  const std::string a = lower_case(spelt_a), b = lower_case(spelt_b);  // capitals are no other word
  std::vector<std::size_t> before, above(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) above[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      // Levenshtein's distance, row by row: the least of inserting, leaving out and exchanging a letter. Two
      // letters in the wrong order, as fingers write them, are one mistake (Damerau).
      row[j] = std::min({above[j] + 1, row[j - 1] + 1, above[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before = std::exchange(above, row);
  }
  return above[b.size()];
}

ConfigError error_at(const Node& node, const toml::source_region& where, std::string_view message) {
  return ConfigError(fmt::format("{}:{}:{}: {}", node.file, where.begin.line, where.begin.column, message));
}

std::string dotted(const Node& node, std::string_view key) {
  return node.path.empty() ? std::string(key) : fmt::format("{}.{}", node.path, key);
}

bool is_known(const Node& node, std::string_view key) {
  return std::find(node.known.begin(), node.known.end(), key) != node.known.end();
}

void mark(Node& node, std::string_view key) {
  if (!is_known(node, key)) node.known.emplace_back(key);
}

const toml::node* find(Node& node, std::string_view key) {
  mark(node, key);
  return node.table->get(key);
}

/// As nearest_word; a key of the same quantity in another unit is near as well.
std::string nearest_key(std::string_view key, const std::vector<std::string>& legal) {
  const std::string near = nearest_word(key, legal);
  if (!near.empty()) return near;
  const auto same = std::find_if(legal.begin(), legal.end(),
                                 [&](const std::string& other) { return same_quantity(key, other); });
  return same == legal.end() ? "" : *same;
}

const toml::node& require(Node& node, std::string_view key) {
  const toml::node* found = find(node, key);
  if (found) return *found;
  std::vector<std::string> strangers;  // most often the key is there, misspelt
  for (const auto& [present, value] : *node.table)
    if (!is_known(node, present.str())) strangers.emplace_back(present.str());
  if (const std::string near = nearest_key(key, strangers); !near.empty())
    throw error_at(node, node.table->find(near)->first.source(),
                   fmt::format("unknown key '{}'; did you mean '{}'?", dotted(node, near), key));
  throw error_at(node, node.table->source(), fmt::format("missing key '{}'", dotted(node, key)));
}

/// The question as it was noted, for what belongs to its form; null where no record is kept.
AskedKey* note(const Node& node, std::string_view key, Form form, bool required) {
  if (!node.record) return nullptr;
  AskedKey& asked = node.record->asked.emplace_back();
  asked.table = node.path;
  asked.kind = node.kind;
  asked.key = key;
  asked.form = form;
  asked.required = required;
  return &asked;
}

void set_range(AskedKey& asked, Range range) {
  asked.min = range.min;
  asked.max = range.max;
}

std::string kind_of(const toml::table& table, const std::string& kind_around) {
  return table["type"].value_or(kind_around);
}

/// As a config would spell it.
std::string spelt(double value) { return fmt::format("{:.12g}", value); }
std::string spelt(std::string_view text) { return fmt::format("\"{}\"", text); }
template <class Values>
std::string spelt_list(const Values& values) {
  std::string out;
  for (const auto& value : values) out += (out.empty() ? "" : ", ") + spelt(value);
  return "[" + out + "]";
}

// No machine has a length, time or force beyond these. Their squares and products stay far from the ends of a
// double.
constexpr double kLargest = 1e15, kSmallest = 1e-12;

std::string legal_range(Range range) {
  const bool above_zero = range.min == kPositive.min, open = std::isinf(range.max);
  if (above_zero) return open ? "above 0" : fmt::format("above 0, up to {},", range.max);
  if (open) return fmt::format("{} or more", range.min);
  return std::isinf(range.min) ? fmt::format("up to {}", range.max)
                               : fmt::format("{} to {}", range.min, range.max);
}

double as_number(const Node& node, const toml::node& value, std::string_view key, Range range) {
  const auto number = value.value<double>();
  if (!value.is_number() || !number)
    throw error_at(node, value.source(),
                   fmt::format("'{}' must be a number{}", dotted(node, key),
                               value.is_string() ? ", without quotes and without a unit" : ""));
  // Written so that a NaN is out of range.
  const bool any = std::isinf(range.min) && std::isinf(range.max);
  if (!any && !(*number >= range.min && *number <= range.max))
    throw error_at(node, value.source(),
                   fmt::format("'{}' = {} is out of range: {} is legal", dotted(node, key), *number,
                               legal_range(range)));
  if (!std::isfinite(*number))
    throw error_at(node, value.source(), fmt::format("'{}' must be a finite number", dotted(node, key)));
  if (std::abs(*number) > kLargest)
    throw error_at(node, value.source(),
                   fmt::format("'{}' = {:g} is too large to be meant: up to {:g} is legal", dotted(node, key),
                               *number, kLargest));
  if (range.min == kPositive.min && *number < kSmallest)
    throw error_at(node, value.source(),
                   fmt::format("'{}' = {:g} is too small to be meant: {:g} or more is legal",
                               dotted(node, key), *number, kSmallest));
  return *number;
}

// Names go into messages, files and terminals. A line feed or a NUL in one of them is never meant.
std::string as_text(const Node& node, const toml::node& value, std::string_view key) {
  constexpr std::size_t kLongest = 1000;  // bytes
  const auto text = value.value<std::string>();
  if (!text)
    throw error_at(node, value.source(), fmt::format("'{}' must be a string in quotes", dotted(node, key)));
  if (text->size() > kLongest)
    throw error_at(
        node, value.source(),
        fmt::format("'{}' has {} bytes; up to {} are legal", dotted(node, key), text->size(), kLongest));
  for (const char c : *text)
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7f')
      throw error_at(node, value.source(),
                     fmt::format("'{}' has a character that cannot be printed (0x{:02x}); leave it out",
                                 dotted(node, key), static_cast<unsigned char>(c)));
  return *text;
}

bool as_boolean(const Node& node, const toml::node& value, std::string_view key) {
  if (!value.is_boolean())
    throw error_at(node, value.source(), fmt::format("'{}' must be true or false", dotted(node, key)));
  return *value.value<bool>();
}

const toml::array& as_array(const Node& node, const toml::node& value, std::string_view key) {
  if (!value.is_array())
    throw error_at(node, value.source(),
                   fmt::format("'{}' must be a list in square brackets", dotted(node, key)));
  return *value.as_array();
}

std::shared_ptr<Node> child(Node& node, const toml::node& value, std::string_view key, std::size_t index,
                            bool in_array) {
  auto& list = node.children[std::string(key)];
  // The same table may be asked for twice. Both must note their questions in one place, or `finish` would
  // call the keys of the one unknown to the other.
  if (index < list.size() && list[index]) return list[index];
  if (!value.is_table())
    throw error_at(node, value.source(), fmt::format("'{}' must be a table", dotted(node, key)));
  auto made = std::make_shared<Node>();
  made->document = node.document;
  made->table = value.as_table();
  made->file = node.file;
  made->path = in_array ? fmt::format("{}[{}]", dotted(node, key), index) : dotted(node, key);
  made->record = node.record;
  if (node.record) made->kind = kind_of(*made->table, node.kind);
  if (list.size() <= index) list.resize(index + 1);
  list[index] = made;
  return made;
}

void finish_node(const Node& node) {
  // A key that lacks its unit, or has another one, is the nearest.
  const auto distance = [](std::string_view key, const std::string& near) {
    return same_quantity(key, near) ? 0 : edit_distance(key, near);
  };
  const toml::key* stranger = nullptr;
  std::string meant;
  for (const auto& [key, value] : *node.table) {
    if (is_known(node, key.str())) continue;
    const std::string near = nearest_key(key.str(), node.known);
    // The one that is nearest to a legal key tells most: others may be legal with the key that was meant.
    const bool nearer =
        !near.empty() && (meant.empty() || distance(key.str(), near) < distance(stranger->str(), meant));
    if (stranger && !nearer) continue;
    stranger = &key;
    meant = near;
  }
  if (!meant.empty())
    throw error_at(node, stranger->source(),
                   fmt::format("unknown key '{}'; did you mean '{}'?", dotted(node, stranger->str()), meant));
  if (stranger)
    throw error_at(node, stranger->source(),
                   fmt::format("unknown key '{}'; legal here: {}", dotted(node, stranger->str()),
                               fmt::join(node.known, ", ")));
  for (const auto& [key, list] : node.children)
    for (const auto& made : list)
      if (made) finish_node(*made);
}

std::string_view line_of(std::string_view text, std::size_t number) {
  for (; number > 1 && text.find('\n') != std::string_view::npos; --number)
    text.remove_prefix(text.find('\n') + 1);
  return text.substr(0, text.find('\n'));
}

// What was meant in a line that TOML refuses for this reason, with the key in front; else the reason.
std::string explain_line(std::string_view line, std::string_view reason) {
  const std::string structure = explain_structure(line, reason);
  if (!structure.empty()) return structure;
  const std::string meant = explain_value(line);
  if (meant.empty()) return std::string(reason);
  std::string_view key = line.substr(0, line.find_first_of(" \t=", line.find_first_not_of(" \t")));
  key.remove_prefix(std::min(key.find_first_not_of(" \t"), key.size()));
  const bool named = meant.find(key) != std::string::npos;
  return named ? meant : fmt::format("'{}': {}", key, meant);
}

ConfigTable make_root(toml::table parsed, const std::string& name, std::shared_ptr<ConfigRecord> record) {
  auto node = std::make_shared<Node>();
  node->document = std::make_shared<const toml::table>(std::move(parsed));
  node->table = node->document.get();
  node->file = name;
  node->record = std::move(record);
  return ConfigTable(node);
}

}  // namespace

std::string nearest_word(std::string_view word, const std::vector<std::string>& legal) {
  return nearest_word(word, legal, word.size() / 3 + 1);
}

std::string nearest_word(std::string_view word, const std::vector<std::string>& legal,
                         std::size_t edits_max) {
  std::string best;
  std::size_t best_distance = edits_max + 1;  // beyond that a proposal would be a guess
  for (const std::string& candidate : legal) {
    const std::size_t distance = edit_distance(word, candidate);
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

double ConfigTable::number(std::string_view key, Range range) const {
  // Noted before the key is looked for: a question that finds no answer in this file is still a key that a
  // config may have.
  if (AskedKey* asked = note(*node_, key, Form::kNumber, true)) set_range(*asked, range);
  return as_number(*node_, require(*node_, key), key, range);
}

double ConfigTable::number(std::string_view key, double fallback, Range range) const {
  if (AskedKey* asked = note(*node_, key, Form::kNumber, false)) {
    set_range(*asked, range);
    asked->fallback = spelt(fallback);
  }
  const toml::node* value = find(*node_, key);
  return value ? as_number(*node_, *value, key, range) : fallback;
}

long ConfigTable::integer(std::string_view key, Range range) const {
  if (AskedKey* asked = note(*node_, key, Form::kWholeNumber, true)) set_range(*asked, range);
  const toml::node& value = require(*node_, key);
  // 5.0 is refused as well: who writes a fraction for a count has most likely mistaken the key.
  if (!value.is_integer())
    throw error_at(*node_, value.source(), fmt::format("'{}' must be a whole number", dotted(*node_, key)));
  as_number(*node_, value, key, range);
  return static_cast<long>(*value.value<int64_t>());
}

long ConfigTable::integer(std::string_view key, long fallback, Range range) const {
  if (AskedKey* asked = note(*node_, key, Form::kWholeNumber, false)) {
    set_range(*asked, range);
    asked->fallback = fmt::format("{}", fallback);
  }
  return find(*node_, key) ? integer(key, range) : fallback;
}

bool ConfigTable::boolean(std::string_view key) const {
  note(*node_, key, Form::kBoolean, true);
  return as_boolean(*node_, require(*node_, key), key);
}

bool ConfigTable::boolean(std::string_view key, bool fallback) const {
  if (AskedKey* asked = note(*node_, key, Form::kBoolean, false))
    asked->fallback = fmt::format("{}", fallback);
  const toml::node* value = find(*node_, key);
  return value ? as_boolean(*node_, *value, key) : fallback;
}

std::string ConfigTable::text(std::string_view key) const {
  note(*node_, key, Form::kText, true);
  return as_text(*node_, require(*node_, key), key);
}

std::string ConfigTable::text(std::string_view key, std::string_view fallback) const {
  if (AskedKey* asked = note(*node_, key, Form::kText, false)) asked->fallback = spelt(fallback);
  const toml::node* value = find(*node_, key);
  return value ? as_text(*node_, *value, key) : std::string(fallback);
}

std::string ConfigTable::choice(std::string_view key, const std::vector<std::string>& choices) const {
  if (AskedKey* asked = note(*node_, key, Form::kChoice, true)) asked->choices = choices;
  const std::string value = text(key);
  if (std::find(choices.begin(), choices.end(), value) != choices.end()) return value;
  const std::string near = nearest_word(value, choices);
  throw error(key, fmt::format("'{}' = \"{}\" is not legal; {}: {}", dotted(*node_, key), value,
                               near.empty() ? "legal" : fmt::format("did you mean \"{}\"? Legal", near),
                               fmt::join(choices, ", ")));
}

std::string ConfigTable::choice(std::string_view key, const std::vector<std::string>& choices,
                                std::string_view fallback) const {
  if (AskedKey* asked = note(*node_, key, Form::kChoice, false)) {
    asked->choices = choices;
    asked->fallback = spelt(fallback);
  }
  return find(*node_, key) ? choice(key, choices) : std::string(fallback);
}

Vec3 ConfigTable::vec3(std::string_view key) const {
  note(*node_, key, Form::kThreeNumbers, true);
  const std::vector<double> values = numbers(key);
  if (values.size() != 3) throw error(key, fmt::format("'{}' must have three numbers", dotted(*node_, key)));
  return {values[0], values[1], values[2]};
}

Vec3 ConfigTable::vec3(std::string_view key, const Vec3& fallback) const {
  if (AskedKey* asked = note(*node_, key, Form::kThreeNumbers, false)) asked->fallback = spelt_list(fallback);
  return find(*node_, key) ? vec3(key) : fallback;
}

std::vector<double> ConfigTable::numbers(std::string_view key) const {
  note(*node_, key, Form::kNumbers, true);
  std::vector<double> out;
  for (const toml::node& value : as_array(*node_, require(*node_, key), key))
    out.push_back(as_number(*node_, value, key, kAnyNumber));
  return out;
}

std::vector<std::string> ConfigTable::texts(std::string_view key) const {
  note(*node_, key, Form::kTexts, true);
  std::vector<std::string> out;
  for (const toml::node& value : as_array(*node_, require(*node_, key), key))
    out.push_back(as_text(*node_, value, key));
  return out;
}

std::vector<std::string> ConfigTable::texts(std::string_view key,
                                            const std::vector<std::string>& fallback) const {
  if (AskedKey* asked = note(*node_, key, Form::kTexts, false)) asked->fallback = spelt_list(fallback);
  return find(*node_, key) ? texts(key) : fallback;
}

ConfigTable ConfigTable::table(std::string_view key) const {
  note(*node_, key, Form::kTable, true);
  return ConfigTable(child(*node_, require(*node_, key), key, 0, false));
}

std::optional<ConfigTable> ConfigTable::table_if(std::string_view key) const {
  note(*node_, key, Form::kTable, false);
  if (!find(*node_, key)) return std::nullopt;
  return table(key);
}

std::vector<ConfigTable> ConfigTable::tables(std::string_view key) const {
  note(*node_, key, Form::kTables, true);
  std::vector<ConfigTable> out;
  for (const toml::node& value : as_array(*node_, require(*node_, key), key))
    out.emplace_back(child(*node_, value, key, out.size(), true));
  return out;
}

std::vector<ConfigTable> ConfigTable::tables_if(std::string_view key) const {
  note(*node_, key, Form::kTables, false);
  return find(*node_, key) ? tables(key) : std::vector<ConfigTable>{};
}

const std::string& ConfigTable::file() const { return node_->file; }

bool ConfigTable::has(std::string_view key) const {
  note(*node_, key, Form::kPresence, false);
  return find(*node_, key) != nullptr;
}

void ConfigTable::finish() const { finish_node(*node_); }

ConfigError ConfigTable::error(std::string_view key, std::string_view message) const {
  const toml::node* value = node_->table->get(key);
  return error_at(*node_, value ? value->source() : node_->table->source(), message);
}

ConfigTable parse_config(std::string_view text, const std::string& name) {
  return parse_config(text, name, nullptr);
}

ConfigTable parse_config(std::string_view text, const std::string& name,
                         std::shared_ptr<ConfigRecord> record) {
  if (const auto flaw = find_encoding_flaw(text))
    throw ConfigError(fmt::format("{}:{}:{}: {}", name, flaw->line, flaw->column, flaw->why));
  try {
    return make_root(toml::parse(text, name), name, std::move(record));
  } catch (const toml::parse_error& bad) {
    const toml::source_position at = bad.source().begin;
    throw ConfigError(fmt::format("{}:{}:{}: {}", name, at.line, at.column,
                                  explain_line(line_of(text, at.line), bad.description())));
  }
}

ConfigTable load_config(const std::string& path) {
  constexpr std::size_t kBytesMax = std::size_t{16} << 20;  // a thousand times a large machine's
  std::string text;
  try {
    text = read_plain_file(path, kBytesMax);
  } catch (const PlainFileError& error) {
    throw ConfigError(fmt::format("{}:1:1: {}", path.c_str(), error.what()));  // no byte 0 in a message
  }
  return parse_config(text, path);
}

}  // namespace trn

#include "app/session/scope_trigger.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

namespace trn {

namespace {

using TriggerKind = ScopeTrigger::Kind;
constexpr std::pair<const char*, TriggerKind> kTriggerKinds[] = {{"rising", TriggerKind::kRising},
                                                                 {"falling", TriggerKind::kFalling},
                                                                 {"above", TriggerKind::kAbove},
                                                                 {"below", TriggerKind::kBelow}};
constexpr const char* kForms =
    "'rising SIGNAL LEVEL', 'falling SIGNAL LEVEL', 'above SIGNAL LEVEL', 'below SIGNAL LEVEL', 'fault' or "
    "'line NUMBER'";

std::optional<double> number(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace

ScopeTrigger parse_trigger(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  if (words.size() == 1 && words[0] == "fault") return {TriggerKind::kRising, "fault", 0.5};
  if (words.size() == 2 && words[0] == "line")
    if (const auto line = number(words[1]); line && *line >= 1) return {TriggerKind::kLine, "line", *line};
  if (words.size() == 3)
    for (const auto& [name, kind] : kTriggerKinds)
      if (const auto level = number(words[2]); words[0] == name && level) return {kind, words[1], *level};
  throw std::invalid_argument(fmt::format("'{}' is no trigger; legal: {}", text, kForms));
}

bool TriggerWatch::fires(double value) {
  if (std::isnan(value)) return false;
  const std::optional<double> before = std::exchange(before_, value);
  const double level = trigger_.level;
  switch (trigger_.kind) {
    case TriggerKind::kRising:
      return before && *before < level && value >= level;
    case TriggerKind::kFalling:
      return before && *before > level && value <= level;
    case TriggerKind::kAbove:
      return value > level;
    case TriggerKind::kBelow:
      return value < level;
    case TriggerKind::kLine:
      return value == level && (!before || *before != level);
  }
  return false;
}

}  // namespace trn

#include "panel/server/page_message.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "app/client/command_rights.h"
#include "app/client/command_table.h"

namespace trn {

namespace {

using nlohmann::json;
using trunnion::command_t;

constexpr std::size_t kIdMax = 64;
constexpr std::int64_t kWholeMax =
    (std::int64_t{1} << 53) - 1;  // the greatest that JavaScript tells from the next

std::int8_t verb_of(const std::string& name) {
  for (const CommandRow& row : kCommands)
    if (name.find(' ') == std::string::npos && same_name(row.name, name)) return row.verb;
  throw BadPageMessage("there is no such verb");
}

std::string text_of(const json& message, const char* key) {
  const auto found = message.find(key);
  if (found == message.end()) return "";
  if (!found->is_string()) throw BadPageMessage(fmt::format("'{}' must be text", key));
  std::string text = found->get<std::string>();
  if (text.find('\0') != std::string::npos) throw BadPageMessage(fmt::format("'{}' has a zero byte", key));
  return text;
}

double number_of(const json& message, const char* key) {
  const auto found = message.find(key);
  if (found == message.end()) return 0;
  const double value = found->is_number() ? found->get<double>() : std::nan("");
  if (!std::isfinite(value)) throw BadPageMessage(fmt::format("'{}' must be a number", key));
  return value;
}

// A whole number from `least` to `most`.
std::int64_t whole_of(const json& message, const char* key, std::int64_t least, std::int64_t most) {
  const auto found = message.find(key);
  const bool whole = found != message.end() && found->is_number_integer();
  const bool sound = whole && *found >= least && *found <= most;
  if (!sound)
    throw BadPageMessage(fmt::format("'{}' must be a whole number from {} to {}", key, least, most));
  return found->get<std::int64_t>();
}

// 0 where it is not said. The daemon knows closer what is legal.
std::int32_t small_of(const json& message, const char* key, std::int64_t least, std::int64_t most) {
  return message.contains(key) ? static_cast<std::int32_t>(whole_of(message, key, least, most)) : 0;
}

bool truth_of(const json& message, const char* key) {
  const auto found = message.find(key);
  if (found == message.end() || !found->is_boolean())
    throw BadPageMessage(fmt::format("'{}' must be true or false", key));
  return found->get<bool>();
}

command_t command_of(const json& message) {
  constexpr int kJointMax = 1000, kAliveMax = 1000;
  command_t command{};
  command.verb = verb_of(text_of(message, "verb"));
  command.joint = small_of(message, "joint", -1, kJointMax);
  command.value = number_of(message, "value");
  command.speed = number_of(message, "speed");
  command.speed_share = number_of(message, "speed_share");
  command.alive_ms = small_of(message, "alive_ms", 0, kAliveMax);
  command.frame = static_cast<std::int8_t>(small_of(message, "frame", command_t::OWN, command_t::PATH));
  command.text = text_of(message, "text");
  return command;
}

json id_of(const json& message) {
  const auto found = message.find("id");
  const bool sound = found != message.end() &&
                     (found->is_number_integer() ||
                      (found->is_string() && found->get_ref<const std::string&>().size() <= kIdMax));
  if (!sound) throw BadPageMessage("a command needs an 'id', a whole number or a short text");
  return *found;
}

// What a page's plot can show: some signals, and not more of the past than it draws at once.
trunnion::scope_request_t scope_of(const json& message) {
  constexpr std::size_t kSignalsMax = 16, kNameMax = 64;
  constexpr std::int64_t kRowsMax = 20000;
  const auto names = message.find("signals");
  if (names == message.end() || !names->is_array() || names->size() > kSignalsMax)
    throw BadPageMessage(fmt::format("'signals' must be a list of {} names at most", kSignalsMax));
  trunnion::scope_request_t request{};
  for (const json& name : *names) {
    if (!name.is_string() || name.get_ref<const std::string&>().size() > kNameMax ||
        name.get_ref<const std::string&>().find('\0') != std::string::npos)
      throw BadPageMessage("a signal has a short name");
    request.signal.push_back(name.get<std::string>());
  }
  request.signal_count = static_cast<std::int32_t>(request.signal.size());
  request.from_period = message.contains("from") ? whole_of(message, "from", -kWholeMax, kWholeMax) : -1;
  request.rows_max = small_of(message, "rows", 1, kRowsMax);
  return request;
}

// Of a message that is its type alone.
std::optional<PageMessage::Kind> kind_of_plain(const std::string& type) {
  using Kind = PageMessage::Kind;
  constexpr std::array<std::pair<std::string_view, Kind>, 4> kPlain{{{"alive", Kind::kAlive},
                                                                     {"take_controls", Kind::kTakeControls},
                                                                     {"give_controls", Kind::kGiveControls},
                                                                     {"keep_controls", Kind::kKeepControls}}};
  for (const auto& [name, kind] : kPlain)
    if (type == name) return kind;
  return std::nullopt;
}

}  // namespace

PageMessage read_page_message(std::string_view text) {
  if (text.size() > kPageMessageMax) throw BadPageMessage("longer than 64 kB");
  const json message = json::parse(text, nullptr, false);
  if (!message.is_object()) throw BadPageMessage("no JSON object");
  PageMessage out;
  const std::string type = text_of(message, "type");
  if (type == "key") {
    out.kind = PageMessage::Kind::kKey;
    out.key = text_of(message, "key");
    return out;
  }
  if (const auto plain = kind_of_plain(type)) {
    out.kind = *plain;
    return out;
  }
  if (type == "hold_when_lost") {
    out.kind = PageMessage::Kind::kHoldWhenLost;
    out.hold_when_lost = truth_of(message, "on");
    return out;
  }
  if (type == "scope") {
    out.kind = PageMessage::Kind::kScope;
    out.id = id_of(message);
    out.scope = scope_of(message);
    return out;
  }
  if (type != "command")
    throw BadPageMessage(
        "'type' must be key, command, take_controls, give_controls, keep_controls, hold_when_lost, scope or "
        "alive");
  out.kind = PageMessage::Kind::kCommand;
  out.id = id_of(message);
  out.command = command_of(message);
  const bool moves = out.command.verb == command_t::JOG && out.command.value != 0;
  if (moves) out.press = whole_of(message, "press", 1, kWholeMax);
  return out;
}

std::optional<LogInMessage> read_log_in(std::string_view text) {
  const json message = json::parse(text, nullptr, false);
  if (!message.is_object()) return std::nullopt;
  try {
    LogInMessage out{text_of(message, "name"), text_of(message, "password")};
    return out.name.empty() || out.password.empty() ? std::nullopt : std::optional(out);
  } catch (const BadPageMessage&) {
    return std::nullopt;
  }
}

}  // namespace trn

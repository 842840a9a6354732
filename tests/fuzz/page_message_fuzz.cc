#include <cmath>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "app/client/command_table.h"
#include "panel/server/page_message.h"
#include "panel/server/web_rules.h"
#include "tests/fuzz/require.h"

// Fuzz target: any text as what a page says over its stream, posts to log in, or shows as headers. What is
// taken is whole: a known verb, finite numbers, texts that end where they seem to, a press where a jog moves.
// Said again, it is the same.
namespace {

using namespace trn;
using fuzz::require;
using nlohmann::json;
using trunnion::command_t;

std::string verb_of(const command_t& command) {
  std::string name(find_command(command.verb)->name);
  for (char& letter : name)
    if (letter == ' ') letter = '_';
  return name;
}

json said_again(const PageMessage& message) {
  const command_t& command = message.command;
  json out{{"type", "command"},
           {"id", message.id},
           {"verb", verb_of(command)},
           {"joint", command.joint},
           {"value", command.value},
           {"speed", command.speed},
           {"speed_share", command.speed_share},
           {"alive_ms", command.alive_ms},
           {"frame", command.frame},
           {"text", command.text}};
  if (message.press > 0) out["press"] = message.press;
  return out;
}

void require_same(const PageMessage& one, const PageMessage& other) {
  const command_t &a = one.command, &b = other.command;
  require(one.kind == other.kind && one.id == other.id && one.press == other.press && a.verb == b.verb,
          "the same message");
  require(a.joint == b.joint && a.value == b.value && a.speed == b.speed && a.speed_share == b.speed_share &&
              a.alive_ms == b.alive_ms && a.frame == b.frame && a.text == b.text,
          "the same values");
}

void check_command(const PageMessage& message) {
  const command_t& command = message.command;
  require(find_command(command.verb), "a verb that the daemon knows");
  require(std::isfinite(command.value) && std::isfinite(command.speed) && std::isfinite(command.speed_share),
          "finite numbers");
  require(command.text.find('\0') == std::string::npos, "no zero byte in a text");
  require(command.frame >= command_t::OWN && command.frame <= command_t::PATH, "a frame");
  require(command.alive_ms >= 0 && command.alive_ms <= 1000 && command.joint >= -1, "values in range");
  const bool moves = command.verb == command_t::JOG && command.value != 0;
  require(moves == (message.press > 0), "a press where a jog moves, and only there");
  require_same(message, read_page_message(said_again(message).dump()));
}

void check_message(std::string_view text) {
  PageMessage message;
  try {
    message = read_page_message(text);
  } catch (const BadPageMessage& bad) {
    require(*bad.what() != '\0', "a refusal says why");
    return;
  }
  require(json::accept(text), "only JSON is a message");
  if (message.kind == PageMessage::Kind::kCommand) check_command(message);
}

void check_headers(std::string_view text) {
  const std::optional<LogInMessage> log_in = read_log_in(text);
  require(!log_in || (!log_in->name.empty() && !log_in->password.empty()), "a log-in has both");
  const std::string cookie = cookie_of(text, "a");
  require(cookie.find(';') == std::string::npos, "a cookie ends at its semicolon");
  const std::optional<std::string> file = page_file(text);
  require(!file || ("/" + *file + "/").find("/../") == std::string::npos, "no way out of the folder");
  require(!is_own_host(text) || text.find('/') == std::string_view::npos, "a host has no path");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  check_message(text);
  check_headers(text);
  return 0;
}

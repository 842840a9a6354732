#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "hal/lcm_messages.h"

// What a page says over its WebSocket.
namespace trn {

inline constexpr std::size_t kPageMessageMax = 65536;  ///< bytes

/// A message that is none; what() says why, for the page.
struct BadPageMessage : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct PageMessage {
  enum class Kind {
    kKey,
    kCommand,
    kTakeControls,
    kGiveControls,
    kKeepControls,
    kAlive,
    kHoldWhenLost,
    kScope
  };
  Kind kind = Kind::kAlive;
  std::string key;                  ///< what the page says that it has
  nlohmann::json id;                ///< of a command: a number or text that comes back with the answer
  trunnion::command_t command;      ///< without client, sequence and expiry
  std::int64_t press = 0;           ///< of a jog: number of the press of a button, which no other press has;
                                    ///< 0 where it only stops one
  trunnion::scope_request_t scope;  ///< without client and sequence; `id` comes back with the answer
  bool hold_when_lost = false;      ///< a program shall hold when this page is lost
};

/// BadPageMessage unless the text is a JSON object of one of the types, with values of the types of
/// command_t.
PageMessage read_page_message(std::string_view text);

/// Who wants to log in; it must not be kept.
struct LogInMessage {
  std::string name, password;
};
/// Of the JSON object that a page posts; nothing if it is none with these two texts.
std::optional<LogInMessage> read_log_in(std::string_view text);

}  // namespace trn

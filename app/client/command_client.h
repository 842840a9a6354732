#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "app/client/access_config.h"
#include "app/client/daemon_line.h"
#include "hal/lcm_link.h"

namespace trn {

/// Talks to the daemon of one machine, over its socket or another line. Not thread-safe.
class CommandClient {
 public:
  struct Config {
    LcmConfig lcm;  ///< the names of the channels
    AccessConfig access;
    double timeout_s = 2;  ///< for the connection, and for the first answer
  };

  /// Over the daemon's socket; NoAnswer as SocketLine.
  explicit CommandClient(const Config& config);
  CommandClient(std::unique_ptr<DaemonLine> line, double timeout_s);
  CommandClient(const CommandClient&) = delete;
  CommandClient& operator=(const CommandClient&) = delete;

  /// Sends (what may not be obeyed late only once the daemon's clock is known, at most a tenth of a second),
  /// and waits for the daemon's final word (outcome is not WORKING), asking again every second in case that
  /// was lost. NoAnswer after the timeout, when a working daemon falls silent, and when it has gone.
  trunnion::acknowledge_t send(trunnion::command_t command);

  /// The longest time between two looks for an answer in the last `send`: above 50 ms this process was kept
  /// from running. The daemon may work for longer.
  std::chrono::steady_clock::duration longest_look() const { return longest_look_; }

  /// The first status, from now on, that `wanted` accepts. NoAnswer if no status at all comes within the
  /// timeout; as long as they come, waits up to `patience_s` for the wanted one, then returns nothing.
  std::optional<trunnion::status_t> wait_status(const std::function<bool(const trunnion::status_t&)>& wanted,
                                                double patience_s);

  /// The last status that was heard; null: none yet.
  const trunnion::status_t* last_status() const { return known_ ? &*known_ : nullptr; }

  /// Offsets and tools as they are now; NoAnswer if they do not come within the timeout.
  trunnion::tables_t tables();

  /// What went wrong and is not acknowledged, or lasts; NoAnswer as `tables`.
  trunnion::alarms_t alarms();

  /// A reading for the machine's corrections. NoAnswer if the daemon is gone.
  void send_sensor(const trunnion::sensor_t& readings);

  /// Calls `show` for every motion_t, with the last status_t, until it returns false; NoAnswer if none comes
  /// within the timeout.
  void watch(const std::function<bool(const trunnion::status_t&, const trunnion::motion_t&)>& show);

 private:
  void listen();
  template <typename Message>
  Message await(const std::optional<Message>& heard);
  bool handle(std::chrono::steady_clock::time_point until);
  [[noreturn]] void no_answer(const std::string& why) const;
  std::int64_t expiry_us(const trunnion::command_t& command);

  std::unique_ptr<DaemonLine> line_;
  double timeout_s_;
  std::int64_t client_;
  std::int32_t sequence_ = 0;
  std::chrono::steady_clock::duration longest_look_{};
  std::optional<trunnion::acknowledge_t> answer_;
  std::optional<trunnion::status_t> status_, known_;
  std::optional<trunnion::motion_t> motion_;
  std::optional<trunnion::tables_t> tables_;
  std::optional<trunnion::alarms_t> alarms_;
  std::int64_t daemon_clock_us_ = 0;  ///< as the last status told it; 0: none was heard
  std::chrono::steady_clock::time_point clock_heard_;
};

}  // namespace trn

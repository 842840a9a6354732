#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>

#include "hal/lcm_link.h"
#include "hal/udp_group.h"

namespace trn {

/// Nobody answered in time; what() says who was asked and what to do.
struct NoAnswer : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Talks to the daemon of one machine. Not thread-safe.
class CommandClient {
 public:
  struct Config {
    LcmConfig lcm;
    double timeout_s = 2;  ///< for the first answer
  };

  /// std::runtime_error if LCM cannot work on this host.
  explicit CommandClient(const Config& config);

  /// Sends (what may not be obeyed late only once the daemon's clock is known, at most a tenth of a second),
  /// and repeats every 0.1 s until the daemon answers; then waits for its final word (outcome is not
  /// WORKING), asking again every second in case that was lost. NoAnswer after the timeout, or when a working
  /// daemon falls silent.
  trunnion::acknowledge_t send(trunnion::command_t command);

  /// The first status, from now on, that `wanted` accepts. NoAnswer if no status at all comes within the
  /// timeout; as long as they come, waits up to `patience_s` for the wanted one, then returns nothing.
  std::optional<trunnion::status_t> wait_status(const std::function<bool(const trunnion::status_t&)>& wanted,
                                                double patience_s);

  /// Calls `show` for every motion_t until it returns false; NoAnswer if none comes within the timeout.
  void watch_motion(const std::function<bool(const trunnion::motion_t&)>& show);

 private:
  [[noreturn]] void no_answer() const;
  std::int64_t expiry_us();

  Config config_;
  std::int64_t client_;
  std::int32_t sequence_ = 0;
  std::optional<trunnion::acknowledge_t> answer_;
  std::optional<trunnion::status_t> status_;
  std::optional<trunnion::motion_t> motion_;
  std::optional<WireSender> daemon_;  ///< who answered; nobody else's status counts from then on
  std::int64_t daemon_clock_us_ = 0;  ///< as the last status told it; 0: none was heard
  std::chrono::steady_clock::time_point clock_heard_;
  LcmLink link_;
};

}  // namespace trn

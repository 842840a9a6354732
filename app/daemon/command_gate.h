#pragma once

#include <chrono>
#include <compare>
#include <map>

#include "hal/local_socket.h"

namespace trn {

/// How many commands are heard: of one process, and of all together.
class CommandGate {
 public:
  /// A process, however many connections it makes.
  struct Sender {
    uid_t uid = 0;
    pid_t pid = 0;
    auto operator<=>(const Sender&) const = default;
  };
  using Clock = std::chrono::steady_clock;
  static constexpr double kSenderRate = 200, kSenderBurst = 100;  ///< commands a second; commands at once
  static constexpr double kTotalRate = 1000, kTotalBurst = 500;
  static constexpr std::size_t kSendersMax = 256;  ///< that are known at a time

  /// Counts a command that comes at `now`; false if it is too many.
  bool admit(const Sender& sender, Clock::time_point now);
  /// True when a sender was turned away and nobody has been told for a minute.
  bool must_tell(Clock::time_point now);

 private:
  struct Bucket {
    double tokens = 0;
    Clock::time_point filled;
    bool take(double rate, double burst, Clock::time_point now);
  };
  Bucket& bucket_of(const Sender& sender, Clock::time_point now);

  std::map<Sender, Bucket> senders_;
  Bucket total_{kTotalBurst, {}};
  Clock::time_point quiet_until_;
};

}  // namespace trn

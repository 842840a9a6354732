#pragma once

#include <chrono>
#include <map>

#include "hal/lcm_link.h"
#include "hal/udp_group.h"

namespace trn {

/// How many commands are heard: of one sender, and of all together.
class CommandGate {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr double kSenderRate = 200, kSenderBurst = 100;  ///< commands a second; commands at once
  static constexpr double kTotalRate = 1000, kTotalBurst = 500;
  static constexpr std::size_t kSendersMax = 256;  ///< that are known at a time

  /// Counts a command that comes at `now`; false if it is too many.
  bool admit(const WireSender& sender, Clock::time_point now);
  /// True when a sender was turned away and nobody has been told for a minute.
  bool must_tell(Clock::time_point now);

 private:
  struct Bucket {
    double tokens = 0;
    Clock::time_point filled;
    bool take(double rate, double burst, Clock::time_point now);
  };
  Bucket& bucket_of(const WireSender& sender, Clock::time_point now);

  std::map<WireSender, Bucket> senders_;
  Bucket total_{kTotalBurst, {}};
  Clock::time_point quiet_until_;
};

}  // namespace trn

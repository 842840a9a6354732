#pragma once

#include <algorithm>
#include <chrono>

namespace trn {

/// So many things a second, and after a pause so many at once.
class TokenBucket {
 public:
  using Clock = std::chrono::steady_clock;

  /// Full at `now`.
  TokenBucket(double rate_hz, double burst, Clock::time_point now)
      : rate_hz_(rate_hz), burst_(burst), tokens_(burst), filled_(now) {}

  bool has(Clock::time_point now) {
    const double passed_s = std::chrono::duration<double>(now - filled_).count();
    tokens_ = std::min(burst_, tokens_ + rate_hz_ * passed_s);
    filled_ = now;
    return tokens_ >= 1;
  }
  bool take(Clock::time_point now) {
    const bool there = has(now);
    if (there) tokens_ -= 1;
    return there;
  }
  /// When it was last asked.
  Clock::time_point asked() const { return filled_; }

 private:
  double rate_hz_, burst_, tokens_;
  Clock::time_point filled_;
};

}  // namespace trn

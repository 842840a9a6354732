#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string>

namespace trn {

/// What was sent to the gateway and came no further.
enum class Refusal : std::uint8_t {
  kUnknownKey,
  kOldCounter,      ///< not above the last one of the key, and not the last one
  kFalseSignature,  ///< or of another machine
  kTooManyFalse,    ///< not looked at: its sender had too many false signatures
  kNoMessage,       ///< truly signed, but neither a sound command nor a sound reading
  kRole,            ///< the key may not do this
  kRate,            ///< too many of one key
  kNoExpiry,        ///< a command that would never expire
  kCount
};

/// Counts refusals, and tells of them once a minute at most.
class RefusalLog {
 public:
  using Clock = std::chrono::steady_clock;

  void note(Refusal why) { ++counts_[static_cast<std::size_t>(why)]; }
  std::uint64_t count(Refusal why) const { return counts_[static_cast<std::size_t>(why)]; }
  /// What has come since the last time, for the log; "" if nothing has, or if it was told within the minute.
  std::string news(Clock::time_point now);

 private:
  using Counts = std::array<std::uint64_t, static_cast<std::size_t>(Refusal::kCount)>;
  Counts counts_{}, told_{};
  Clock::time_point quiet_until_;
};

}  // namespace trn

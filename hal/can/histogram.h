#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "core/realtime.h"

namespace trn {

/// Counts durations in quarter octaves from 1 us to about 1 s. One thread adds, any reads.
class TimeHistogram {
 public:
  void add(std::int64_t duration_ns) TRN_RT;
  /// Upper bound of the bucket that holds the given share (0 to 1) of all durations, us; 0 if there are none.
  double percentile_us(double share) const;
  double max_us() const { return static_cast<double>(max_ns_.load(std::memory_order_relaxed)) / 1000; }
  std::uint64_t count() const;

 private:
  static constexpr int kBuckets = 84;
  std::array<std::atomic<std::uint32_t>, kBuckets> counts_{};
  std::atomic<std::int64_t> max_ns_ = 0;
};

}  // namespace trn

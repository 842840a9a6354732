#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

#include "core/realtime.h"

namespace trn {

/// Counts durations in buckets of a quarter of an octave, from 1 us to about 2 s; what is shorter or longer
/// counts to the first or the last. One thread adds, any reads.
class TimeHistogram {
 public:
  void add(std::int64_t duration_ns) TRN_RT;
  /// Upper edge of the bucket that holds the given share (0 to 1) of all durations, us, and never more than
  /// the longest duration; 0 if there are none. Never below the truth, at most a quarter above it.
  double percentile_us(double share) const;
  /// Durations below an edge that are not below the one before it.
  struct Bucket {
    double edge_us = 0;
    std::uint32_t count = 0;
  };
  /// From the first one that is not empty to the last one, shortest durations first.
  std::vector<Bucket> buckets() const;
  double max_us() const { return static_cast<double>(max_ns_.load(std::memory_order_relaxed)) / 1000; }

 private:
  static constexpr int kBuckets = 84;
  static double edge_us(int bucket);

  std::array<std::atomic<std::uint32_t>, kBuckets> counts_{};
  std::atomic<std::int64_t> max_ns_ = 0;
};

}  // namespace trn

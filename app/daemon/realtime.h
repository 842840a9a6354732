#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "app/session/realtime_config.h"
#include "core/realtime.h"

namespace trn {

/// Locks the memory of the process, present and future. "" or what was refused, why, and how to mend it.
std::string lock_memory();
/// Gives the calling thread its priority and processor, and touches its stack so that it is there. What was
/// refused, why, and how to mend it; empty if all was granted.
std::vector<std::string> make_thread_realtime(const RealtimeConfig& config);

/// Counts durations in quarter octaves of a microsecond, from 1 us to about 1 s. One thread adds, any reads.
class LatencyHistogram {
 public:
  void add(std::int64_t duration_ns) TRN_RT;
  /// Upper bound of the bucket that holds the given share (0 to 1) of all durations, us; 0 if there are none.
  double percentile_us(double share) const;
  double max_us() const { return static_cast<double>(max_ns_.load(std::memory_order_relaxed)) / 1000; }

 private:
  static constexpr int kBuckets = 84;
  std::array<std::atomic<std::uint32_t>, kBuckets> counts_{};
  std::atomic<std::int64_t> max_ns_ = 0;
};

/// What the loop saw of its own punctuality.
struct LoopStatistics {
  LatencyHistogram wake;  ///< lateness of the tick's start
  LatencyHistogram tick;  ///< duration of the tick
  std::atomic<std::uint64_t> periods = 0;
  std::atomic<std::uint64_t> overruns = 0;  ///< deadlines missed
};

/// Calls `tick(late_periods)` once a period at absolute deadlines (clock_nanosleep, CLOCK_MONOTONIC) until it
/// returns false. A deadline that was missed is counted and left out, never made up for: motion advances by
/// periods, not by the clock. std::system_error if the clock refuses.
void run_periodic(std::int64_t period_ns, LoopStatistics& statistics, const std::function<bool(int)>& tick);

}  // namespace trn

#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "app/session/realtime_config.h"
#include "core/time_histogram.h"

namespace trn {

/// What a recording or a program has needed once does not stay: large blocks go back to the system when they
/// are freed.
void give_back_large_blocks();
/// Locks the memory of the process, present and future. "" or what was refused, why, and how to mend it.
std::string lock_memory();
/// Gives the calling thread its priority and processor, and touches its stack so that it is there. What was
/// refused, why, and how to mend it; empty if all was granted.
std::vector<std::string> make_thread_realtime(const RealtimeConfig& config);

/// What the loop saw of its own punctuality.
struct LoopStatistics {
  TimeHistogram wake;  ///< lateness of the tick's start
  TimeHistogram tick;  ///< duration of the tick
  std::atomic<std::uint64_t> periods = 0;
  std::atomic<std::uint64_t> overruns = 0;  ///< deadlines missed
  /// For the tick alone: how late this one began, and how long the one before took.
  std::int64_t wake_now_ns = 0, tick_before_ns = 0;
};

/// Calls `tick(late_periods)` once a period at absolute deadlines (clock_nanosleep, CLOCK_MONOTONIC) until it
/// returns false. A deadline that was missed is counted and left out, never made up for: motion advances by
/// periods, not by the clock. std::system_error if the clock refuses.
void run_periodic(std::int64_t period_ns, LoopStatistics& statistics, const std::function<bool(int)>& tick);

}  // namespace trn

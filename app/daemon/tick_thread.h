#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "app/daemon/realtime.h"
#include "app/session/realtime_config.h"

namespace trn {

/// The real-time thread: calls `tick(late_periods, statistics)` every period from construction to
/// destruction.
class TickThread {
 public:
  /// Returns when the thread runs and has, or has been refused, its real-time rights.
  using Tick = std::function<void(int, const LoopStatistics&)>;
  TickThread(const RealtimeConfig& config, double period_s, Tick tick);
  ~TickThread();
  TickThread(const TickThread&) = delete;
  TickThread& operator=(const TickThread&) = delete;

  /// No tick comes after this one, and the statistics stand. May be called again.
  void end();

  /// What the kernel refused, each with its remedy.
  const std::vector<std::string>& refused() const { return refused_; }
  const LoopStatistics& statistics() const { return statistics_; }
  /// The loop ended by itself: the clock failed.
  bool failed() const { return failed_; }

 private:
  LoopStatistics statistics_;
  std::atomic<bool> stop_ = false, failed_ = false;
  std::vector<std::string> refused_;
  std::thread thread_;
};

/// SIGTERM and SIGINT, taken in the main loop instead of in a handler. Construct before any thread.
class TerminationSignals {
 public:
  TerminationSignals();
  ~TerminationSignals();
  TerminationSignals(const TerminationSignals&) = delete;
  TerminationSignals& operator=(const TerminationSignals&) = delete;

  /// True once for each signal that has come since the last call.
  bool taken();

 private:
  int fd_;
};

}  // namespace trn

#pragma once

#include "core/fault.h"
#include "core/realtime.h"
#include "kernel/rt_messages.h"

namespace trn {

/// The tick as the daemon sees it.
class TickPort {
 public:
  virtual ~TickPort() = default;
  /// One period, in the real-time thread.
  virtual void tick() TRN_RT = 0;
  /// Latches a fault, in the real-time thread.
  virtual void latch(Fault fault) TRN_RT = 0;
  /// Before a tick, in the real-time thread: how late it begins, and how long the one before took; for the
  /// report.
  virtual void tell_times(double /*wake_us*/, double /*tick_us*/) TRN_RT {}
  /// From the daemon's thread; false if the ring is full.
  virtual bool post(const RtCommand& command) = 0;
  /// The next report that has not been read; false if there is none.
  virtual bool next_report(CycleReport& report) = 0;
};

}  // namespace trn

#pragma once

#include <atomic>

#include "core/check.h"

// What the thread that brings drives up asks of the tick, as bits of one word. A bring-up may take seconds. A
// quick stop that comes meanwhile takes it back: what it sets up gets no power at its end.
namespace trn {

/// The bit beside the drives' own: a bring-up is under way, and no quick stop has come since it began.
inline constexpr unsigned kComingUp = 1u << 31;

/// At the end of a bring-up, which began with kComingUp: asks for `enable` unless a quick stop has come.
inline void ask_unless_stopped(std::atomic<unsigned>& requests, unsigned enable) {
  unsigned asked = requests.load();
  while ((asked & kComingUp) && !requests.compare_exchange_weak(asked, (asked & ~kComingUp) | enable)) {
  }
}

/// What is asked, once. It never waits for the other thread: what is asked meanwhile is taken next time.
inline unsigned take_asked(std::atomic<unsigned>& requests) TRN_RT {
  const unsigned asked = requests.load(std::memory_order_acquire) & ~kComingUp;
  if (asked != 0) requests.fetch_and(~asked, std::memory_order_acq_rel);
  return asked;
}

/// A quick stop.
inline void take_back(std::atomic<unsigned>& requests, unsigned enable) TRN_RT {
  requests.fetch_and(~(kComingUp | enable), std::memory_order_acq_rel);
}

}  // namespace trn

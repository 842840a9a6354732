#pragma once

#include <readerwriterqueue/readerwriterqueue.h>

#include <cstddef>

#include "core/realtime.h"

namespace trn {

/// Bounded single-producer single-consumer queue between a non-real-time thread and the tick (either way).
/// Never allocates after construction; full and empty are return values, nobody waits.
template <typename T>
class Ring {
 public:
  explicit Ring(std::size_t capacity) : queue_(capacity) {}

  bool try_push(const T& item) TRN_RT { return queue_.try_enqueue(item); }
  const T* front() const TRN_RT { return queue_.peek(); }
  bool pop() TRN_RT { return queue_.pop(); }
  bool try_pop(T& item) TRN_RT { return queue_.try_dequeue(item); }
  std::size_t size_approx() const TRN_RT { return queue_.size_approx(); }

 private:
  moodycamel::ReaderWriterQueue<T> queue_;
};

}  // namespace trn

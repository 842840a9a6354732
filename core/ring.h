#pragma once

// The queue tells the thread sanitizer at its fences who waits for whom, but knows it under clang only.
#if defined(__SANITIZE_THREAD__) && !defined(AE_TSAN_ANNOTATE_RELEASE)
extern "C" void AnnotateHappensBefore(const char*, int, void*);
extern "C" void AnnotateHappensAfter(const char*, int, void*);
namespace trn {
inline int ring_fences;
}
#define AE_TSAN_ANNOTATE_RELEASE() AnnotateHappensBefore(__FILE__, __LINE__, &::trn::ring_fences)
#define AE_TSAN_ANNOTATE_ACQUIRE() AnnotateHappensAfter(__FILE__, __LINE__, &::trn::ring_fences)
#endif

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

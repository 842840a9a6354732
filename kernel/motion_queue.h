#pragma once

#include <atomic>
#include <cstdint>

#include "core/motion.h"
#include "core/ring.h"

namespace trn {

/// The ring between planner and tick, with what both must know of its content: how much motion it holds, and
/// whether a stop is among it. Blocks belong to a generation (a program); those of a dropped one are skipped.
class MotionQueue {
 public:
  explicit MotionQueue(std::size_t capacity) : ring_(capacity) {}

  // Planner's side.
  bool push(const MotionBlock& block) {
    if (!ring_.try_push({block, generation_.load(std::memory_order_relaxed)})) return false;
    pushed_ns_.fetch_add(duration_ns(block), std::memory_order_release);
    if (block.segment_count == 0 || block.ends_at_rest) pushed_stops_.fetch_add(1, std::memory_order_release);
    return true;
  }
  /// What is pushed from now on belongs to a new program.
  void begin_generation() { generation_.fetch_add(1, std::memory_order_acq_rel); }

  // Tick's side.
  const MotionBlock* front() TRN_RT {
    const Item* item = ring_.front();
    for (int skipped = 0; item && item->generation <= dropped_ && skipped < kDropsPerTick; ++skipped) {
      pop();
      item = ring_.front();
    }
    return item && item->generation > dropped_ ? &item->block : nullptr;
  }
  /// The front is being driven: its time no longer counts as ahead.
  void begin_front() TRN_RT {
    if (begun_) return;
    begun_ = true;
    if (const Item* item = ring_.front())
      begun_ns_.fetch_add(duration_ns(item->block), std::memory_order_release);
  }
  void pop() TRN_RT {
    const Item* item = ring_.front();
    if (!item) return;
    begin_front();
    begun_ = false;
    if (item->block.segment_count == 0 || item->block.ends_at_rest)
      popped_stops_.fetch_add(1, std::memory_order_release);
    ring_.pop();
  }
  /// Forgets everything pushed so far.
  void drop_all() TRN_RT { dropped_ = generation_.load(std::memory_order_acquire); }

  // Either side.
  /// Plan time behind the block that is being driven.
  double buffered_s() const TRN_RT {
    return 1e-9 * static_cast<double>(pushed_ns_.load(std::memory_order_acquire) -
                                      begun_ns_.load(std::memory_order_acquire));
  }
  bool holds_stop() const TRN_RT {
    return pushed_stops_.load(std::memory_order_acquire) != popped_stops_.load(std::memory_order_acquire);
  }

 private:
  struct Item {
    MotionBlock block;
    std::uint64_t generation = 0;
  };
  static constexpr int kDropsPerTick = 64;

  static std::int64_t duration_ns(const MotionBlock& block) TRN_RT {
    double sum = 0;
    for (int i = 0; i < block.segment_count; ++i)
      sum += block.segments[static_cast<std::size_t>(i)].duration_s;
    return static_cast<std::int64_t>(1e9 * sum);
  }

  Ring<Item> ring_;
  std::uint64_t dropped_ = 0;
  std::atomic<std::uint64_t> generation_{1};
  bool begun_ = false;
  std::atomic<std::int64_t> pushed_ns_{0}, begun_ns_{0};
  std::atomic<std::int64_t> pushed_stops_{0}, popped_stops_{0};
};

}  // namespace trn

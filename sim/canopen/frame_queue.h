#pragma once

#include <cstddef>
#include <vector>

#include "core/check.h"
#include "hal/can/frame.h"

namespace trn {

/// Frames in order, each with the time from which it may be sent. Bounded; allocates only when it is made.
class FrameQueue {
 public:
  explicit FrameQueue(std::size_t capacity) : items_(capacity) {}

  bool empty() const { return count_ == 0; }
  std::size_t size() const { return count_; }
  std::size_t room() const { return items_.size() - count_; }
  const CanFrame& front() const { return items_[first_].frame; }
  std::int64_t front_time_ns() const { return items_[first_].time_ns; }
  std::int64_t back_time_ns() const { return items_[(first_ + count_ - 1) % items_.size()].time_ns; }

  /// False if it is full.
  bool push(const CanFrame& frame, std::int64_t time_ns = 0) {
    if (room() == 0) return false;
    items_[(first_ + count_++) % items_.size()] = {time_ns, frame};
    return true;
  }
  void pop() {
    TRN_CHECK(count_ > 0);
    first_ = (first_ + 1) % items_.size();
    --count_;
  }
  void clear() { count_ = 0; }

 private:
  struct Item {
    std::int64_t time_ns = 0;
    CanFrame frame;
  };
  std::vector<Item> items_;
  std::size_t first_ = 0, count_ = 0;
};

}  // namespace trn

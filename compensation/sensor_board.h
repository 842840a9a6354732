#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "core/check.h"
#include "core/realtime.h"

namespace trn {

/// A new reading, in the sensor's own unit (degrees Celsius for a screw); channel -1: none.
struct SensorSample {
  int channel = -1;
  double value = 0;
};

/// Named readings that somebody outside the tick refreshes and others look at; wait-free. Corrections name
/// the channels they want (`sensor` in the config); whoever has a reading of that name publishes each new
/// one. What corrections go by is what the tick has heard, a channel a period in turn, so that a session's
/// log can tell when each reading took effect.
class SensorBoard {
 public:
  static constexpr int kMax = 16;
  struct Heard {
    std::uint32_t count = 0;  ///< of readings
    double value = 0;         ///< the last
  };
  /// Number of the channel `name`, made if there is none; -1: the board is full. Before threads start.
  int channel(const std::string& name) {
    const auto found = std::find(names_.begin(), names_.end(), name);
    if (found == names_.end() && names_.size() == kMax) return -1;
    if (found == names_.end()) names_.push_back(name);
    return static_cast<int>(std::find(names_.begin(), names_.end(), name) - names_.begin());
  }
  /// Number of the channel `name`; -1: nobody wants it.
  int find(const std::string& name) const {
    const auto found = std::find(names_.begin(), names_.end(), name);
    return found == names_.end() ? -1 : static_cast<int>(found - names_.begin());
  }
  /// From one thread a channel.
  void publish(int channel, double value) noexcept {
    Slot& slot = slots_[static_cast<std::size_t>(channel)];
    TRN_CHECK(channel >= 0 && static_cast<std::size_t>(channel) < names_.size());
    slot.value.store(value, std::memory_order_relaxed);
    slot.count.fetch_add(1, std::memory_order_release);
  }
  /// The tick, once a period: looks at the next channel. Returns what is new there.
  SensorSample listen() TRN_RT {
    if (names_.empty()) return {};
    turn_ = (turn_ + 1) % names_.size();
    Slot& slot = slots_[turn_];
    const std::uint32_t count = slot.count.load(std::memory_order_acquire);
    if (count == slot.seen) return {};
    slot.seen = count;
    TRN_CHECK(turn_ < kMax);
    slot.heard = {slot.heard.count + 1, slot.value.load(std::memory_order_relaxed)};
    return {static_cast<int>(turn_), slot.heard.value};
  }
  /// What the tick has heard; its thread only.
  const Heard& heard(int channel) const TRN_RT { return slots_[static_cast<std::size_t>(channel)].heard; }
  const std::vector<std::string>& names() const { return names_; }

 private:
  struct Slot {
    std::atomic<double> value{0};
    std::atomic<std::uint32_t> count{0};
    std::uint32_t seen = 0;
    Heard heard;
  };
  std::vector<std::string> names_;
  std::size_t turn_ = 0;
  std::array<Slot, kMax> slots_;
};

}  // namespace trn

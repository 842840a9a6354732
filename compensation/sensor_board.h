#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

namespace trn {

/// Named readings that somebody outside the tick refreshes and others look at; wait-free. Corrections name
/// the channels they want (`sensor` in the config); whoever has a reading of that name publishes each new
/// one.
class SensorBoard {
 public:
  static constexpr int kMax = 16;
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
    slot.value.store(value, std::memory_order_relaxed);
    slot.count.fetch_add(1, std::memory_order_release);
  }
  /// How often the channel was refreshed, and its last value.
  std::uint32_t count(int channel) const noexcept {
    return slots_[static_cast<std::size_t>(channel)].count.load(std::memory_order_acquire);
  }
  double value(int channel) const noexcept {
    return slots_[static_cast<std::size_t>(channel)].value.load(std::memory_order_relaxed);
  }
  const std::vector<std::string>& names() const { return names_; }

 private:
  struct Slot {
    std::atomic<double> value{0};
    std::atomic<std::uint32_t> count{0};
  };
  std::vector<std::string> names_;
  std::array<Slot, kMax> slots_;
};

}  // namespace trn

#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <vector>

namespace trn {

/// Bounded single-producer single-consumer queue between two processes: its items, and this object, lie in
/// memory that both have at the same place. Full and empty are return values, nobody waits. Where the
/// producer dies within a push, the item is not there.
template <typename T>
class SharedRing {
 public:
  SharedRing(std::size_t capacity, std::pmr::memory_resource* memory) : items_(capacity, memory) {}
  /// Memory for the items.
  static constexpr std::size_t bytes(std::size_t capacity) { return capacity * sizeof(T); }

  // Producer.
  bool try_push(const T& item) {
    const std::uint64_t put = put_.load(std::memory_order_relaxed);
    if (put - taken_.load(std::memory_order_acquire) >= items_.size()) return false;
    items_[put % items_.size()] = item;
    put_.store(put + 1, std::memory_order_release);
    return true;
  }

  // Consumer. The other process may be out of its mind: what it counts is not believed beyond the capacity.
  const T* front() const {
    const std::uint64_t taken = taken_.load(std::memory_order_relaxed);
    const std::uint64_t waiting = put_.load(std::memory_order_acquire) - taken;
    return waiting == 0 || waiting > items_.size() ? nullptr : &items_[taken % items_.size()];
  }
  void pop() { taken_.store(taken_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }
  /// All that is there now.
  void clear() { taken_.store(put_.load(std::memory_order_acquire), std::memory_order_release); }

 private:
  std::pmr::vector<T> items_;
  std::atomic<std::uint64_t> put_{0}, taken_{0};
};

}  // namespace trn

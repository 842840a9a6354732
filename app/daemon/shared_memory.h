#pragma once

#include <cstddef>
#include <memory_resource>

namespace trn {

/// Memory that this process and those that it makes later see at the same place. It is given out once, from
/// its beginning on, and taken back as a whole.
class SharedMemory final : public std::pmr::memory_resource {
 public:
  /// std::system_error.
  explicit SharedMemory(std::size_t bytes);
  ~SharedMemory() override;
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override;
  void do_deallocate(void*, std::size_t, std::size_t) override {}
  bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override { return this == &other; }

  void* begin_;
  void* free_;
  std::size_t bytes_, left_;
};

}  // namespace trn

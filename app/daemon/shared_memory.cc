#include "app/daemon/shared_memory.h"

#include <sys/mman.h>

#include <cerrno>
#include <memory>
#include <new>
#include <system_error>

namespace trn {

SharedMemory::SharedMemory(std::size_t bytes)
    : begin_(mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)),
      free_(begin_),
      bytes_(bytes),
      left_(bytes) {
  if (begin_ == MAP_FAILED) throw std::system_error(errno, std::generic_category(), "shared memory");
}

SharedMemory::~SharedMemory() { munmap(begin_, bytes_); }

void* SharedMemory::do_allocate(std::size_t bytes, std::size_t alignment) {
  void* const at = std::align(alignment, bytes, free_, left_);
  if (!at) throw std::bad_alloc();
  free_ = static_cast<char*>(at) + bytes;
  left_ -= bytes;
  return at;
}

}  // namespace trn

#include "kernel/daemon/process_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

namespace trn {

namespace {

std::string lock_folder() {
  const char* user_folder = std::getenv("XDG_RUNTIME_DIR");
  if (access("/run", W_OK) == 0) return "/run";
  if (user_folder && access(user_folder, W_OK) == 0) return user_folder;
  return "/tmp";
}

std::string holder(int fd) {
  char text[32] = {};
  const ssize_t size = pread(fd, text, sizeof text - 1, 0);
  return size > 0 ? fmt::format("process {}", std::string(text, static_cast<std::size_t>(size)))
                  : std::string("another process");
}

}  // namespace

ProcessLock::ProcessLock(const std::string& machine) {
  const std::string path = fmt::format("{}/trunnion-{}.lock", lock_folder(), machine);
  fd_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (fd_ < 0)
    throw std::runtime_error(fmt::format("cannot open the lock file {}: {}", path, std::strerror(errno)));
  if (flock(fd_, LOCK_EX | LOCK_NB) != 0) {
    const std::string who = holder(fd_);
    close(fd_);
    throw std::runtime_error(fmt::format(
        "machine '{}' is already run by {} (lock file {}); stop that one first", machine, who, path));
  }
  const std::string pid = std::to_string(getpid());
  const bool written = ftruncate(fd_, 0) == 0 && pwrite(fd_, pid.data(), pid.size(), 0) > 0;
  if (written) return;
  close(fd_);
  throw std::runtime_error(fmt::format("cannot write the lock file {}", path));
}

ProcessLock::~ProcessLock() { close(fd_); }

}  // namespace trn

#include "app/daemon/process_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "app/client/daemon_place.h"

namespace trn {

namespace {

std::string holder(int fd) {
  char text[32] = {};
  const ssize_t size = pread(fd, text, sizeof text - 1, 0);
  return size > 0 ? fmt::format("process {}", std::string(text, static_cast<std::size_t>(size)))
                  : std::string("another process");
}

// Only a regular file of one name is written.
int open_lock(const std::string& path) {
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0640);
  if (fd < 0)
    throw std::runtime_error(fmt::format("cannot open the lock file {}: {}", path, std::strerror(errno)));
  struct stat info {};
  if (fstat(fd, &info) == 0 && S_ISREG(info.st_mode) && info.st_nlink == 1) return fd;
  close(fd);
  throw std::runtime_error(fmt::format("the lock file {} is no plain file; remove it", path));
}

}  // namespace

ProcessLock::ProcessLock(const std::string& machine) : ProcessLock(machine, lock_folders()) {}

ProcessLock::ProcessLock(const std::string& machine, const std::vector<std::string>& folders) {
  const std::string path = fmt::format("{}/trunnion-{}.lock", private_folder(folders), machine);
  fd_ = open_lock(path);
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

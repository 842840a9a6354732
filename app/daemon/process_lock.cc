#include "app/daemon/process_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>

#include "app/client/daemon_place.h"

namespace trn {

namespace {

// As the holder wrote it; others may have written anything there since.
std::string holder(int fd) {
  char text[128] = {};
  const ssize_t size = pread(fd, text, sizeof text - 1, 0);
  std::string said(text, static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  std::erase_if(said, [](unsigned char letter) { return letter < ' ' || letter > '~'; });
  return said.empty() ? std::string("another process") : fmt::format("process {}", said);
}

bool write_holder(int fd, const std::string& text) {
  return ftruncate(fd, 0) == 0 && pwrite(fd, text.data(), text.size(), 0) > 0;
}

constexpr int kFlags = O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;

// Only a regular file of one name is written.
void check_lock(int fd, const std::string& path) {
  struct stat info {};
  if (fstat(fd, &info) == 0 && S_ISREG(info.st_mode) && info.st_nlink == 1) return;
  close(fd);
  throw std::runtime_error(fmt::format("the lock file {} is no plain file; remove it", path));
}

int open_lock(const std::string& path) {
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | kFlags, 0640);
  if (fd < 0)
    throw std::runtime_error(fmt::format("cannot open the lock file {}: {}", path, std::strerror(errno)));
  check_lock(fd, path);
  return fd;
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
  if (write_holder(fd_, std::to_string(getpid()))) return;
  close(fd_);
  throw std::runtime_error(fmt::format("cannot write the lock file {}", path));
}

ProcessLock::~ProcessLock() { close(fd_); }

TableLock::TableLock(const std::string& path, const std::string& machine) {
  if (path.empty()) return;
  std::error_code none;
  const std::filesystem::path whole = std::filesystem::weakly_canonical(path, none);  // one name for one file
  const std::string file = none ? path : whole.string(), name = file + ".lock";
  fd_ = open(name.c_str(), O_RDWR | O_CREAT | kFlags, 0600);  // who can open it can keep the daemon out
  if (fd_ < 0) {
    missing_ = fmt::format("{}: {}; whether another daemon changes {} is not known", name,
                           std::strerror(errno), file);
    return;
  }
  check_lock(fd_, name);
  if (flock(fd_, LOCK_EX | LOCK_NB) == 0) {
    write_holder(fd_, fmt::format("{} of machine '{}'", getpid(), machine));  // only for who finds it taken
    return;
  }
  const bool taken = errno == EWOULDBLOCK;
  const std::string who = holder(fd_), why = std::strerror(errno);
  close(fd_);
  fd_ = -1;
  if (taken)
    throw std::runtime_error(fmt::format(
        "{} is already changed by {} (lock file {}): give each machine a file of its own, or stop that one "
        "first",
        file, who, name));
  missing_ = fmt::format("{}: {}; whether another daemon changes {} is not known", name, why, file);
}

TableLock::~TableLock() {
  if (fd_ >= 0) close(fd_);
}

}  // namespace trn

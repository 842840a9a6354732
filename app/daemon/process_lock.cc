#include "app/daemon/process_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <pwd.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>

namespace trn {

namespace {

constexpr const char* kSystemFolder = "/run/trunnion";

std::string of_environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? std::string(value).substr(0, std::string_view(value).find(':')) : std::string();
}

// As the system knows it: HOME may be anything.
std::string home_folder() {
  const passwd* user = getpwuid(geteuid());
  return user && user->pw_dir && user->pw_dir[0] == '/' ? user->pw_dir : "";
}

// "" if the folder is private and can be written; otherwise why not.
std::string refuse_folder(const std::string& path) {
  struct stat info {};
  if (lstat(path.c_str(), &info) != 0) return std::strerror(errno);
  if (!S_ISDIR(info.st_mode)) return "it is no folder of its own";
  const bool systems = path == kSystemFolder && (info.st_uid == 0 || geteuid() == 0);  // root made it
  if (info.st_uid != geteuid() && !systems) return "it belongs to another user";
  if (info.st_mode & (S_IWGRP | S_IWOTH)) return "others can write it";
  return access(path.c_str(), W_OK | X_OK) == 0 ? "" : std::strerror(errno);
}

std::string make_and_judge(const std::string& path) {
  std::error_code ignored;  // told by the judgement
  const std::string home = home_folder();
  if (!home.empty() && path.rfind(home + "/", 0) == 0)
    std::filesystem::create_directories(std::filesystem::path(path).parent_path(), ignored);
  mkdir(path.c_str(), 0750);
  return refuse_folder(path);
}

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

std::vector<std::string> lock_folders() {
  std::vector<std::string> folders{of_environment("RUNTIME_DIRECTORY"), kSystemFolder,
                                   of_environment("XDG_RUNTIME_DIR")};
  const std::string home = home_folder();
  folders.push_back(home.empty() ? "" : home + "/.local/state/trunnion");
  folders.push_back(fmt::format("/tmp/trunnion-{}", geteuid()));
  std::erase(folders, "");
  return folders;
}

std::string private_folder(const std::vector<std::string>& folders) {
  std::string refused;
  for (const std::string& folder : folders) {
    const std::string why = make_and_judge(folder);
    if (why.empty()) return folder;
    refused += fmt::format("\n  {}: {}", folder, why);
  }
  throw std::runtime_error("no private folder for the lock file of the machine; set XDG_RUNTIME_DIR to one:" +
                           refused);
}

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

bool is_trusted_user(uid_t user) {
  if (user == 0 || user == geteuid()) return true;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(kSystemFolder, none)) {
    struct stat info {};
    if (lstat(entry.path().c_str(), &info) == 0 && S_ISDIR(info.st_mode) && info.st_uid == user) return true;
  }
  return false;
}

}  // namespace trn

#include "core/safe_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>

namespace trn {

namespace {

constexpr mode_t kNewFileMode = 0640;
constexpr mode_t kAnyWrite = 0222, kPermissions = 0777;

[[noreturn]] void fail(const std::string& path, std::string_view why, std::string_view help) {
  throw FileError(fmt::format("{}: cannot be written: {}; {}", path, why, help));
}

[[noreturn]] void fail_errno(const std::string& path) {
  const int error = errno;
  std::string_view help = "name a file in a folder that this user may write";
  if (error == ENOSPC || error == EDQUOT) help = "make room on the disk";
  if (error == EROFS) help = "name a file on a disk that can be written";
  if (error == EIO) help = "the disk may be failing; save its data";
  fail(path, std::strerror(error), help);
}

/// Closes at the end of its scope.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

/// Removes the file at the end of its scope, unless it was kept.
class Temporary {
 public:
  explicit Temporary(std::string path) : path_(std::move(path)) {}
  ~Temporary() {
    if (!kept_) ::unlink(path_.c_str());
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  void keep() { kept_ = true; }

 private:
  std::string path_;
  bool kept_ = false;
};

struct Names {
  explicit Names(const std::string& path) {
    const std::size_t slash = path.rfind('/');
    const std::size_t name = slash == std::string::npos ? 0 : slash + 1;
    if (name == path.size()) fail(path, "it names no file", "name a file");
    folder = slash == std::string::npos ? "." : path.substr(0, std::max<std::size_t>(slash, 1));
    // In the same folder, since a rename moves a file in one step within a file system only.
    fresh = fmt::format("{}.{}.new", path.substr(0, name), path.substr(name));
  }
  std::string folder, fresh;
};

// What stands at `path` now, if anything.
std::optional<struct stat> find_old(const std::string& path) {
  struct stat old {};
  if (::lstat(path.c_str(), &old) != 0) {
    if (errno == ENOENT) return std::nullopt;
    fail_errno(path);
  }
  // A rename would replace the link by a file and leave what it points to as it was.
  if (S_ISLNK(old.st_mode)) fail(path, "it is a link", "name the file itself");
  if (!S_ISREG(old.st_mode)) fail(path, "it is no regular file", "name a regular file");
  // Root may write into any file. The mode still says that somebody wants this one kept.
  if ((old.st_mode & kAnyWrite) == 0) fail(path, "it is read-only", "allow writing with 'chmod u+w'");
  if (::faccessat(AT_FDCWD, path.c_str(), W_OK, AT_EACCESS) != 0) fail_errno(path);
  return old;
}

void write_all(int fd, std::string_view text, const std::string& path) {
  while (!text.empty()) {
    // A write may take a part only, as on a disk that is filling up.
    const ssize_t written = ::write(fd, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail_errno(path);
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

// The owner can be kept by root only; anybody else's new file is his own.
void take_over(int fd, const struct stat& old, const std::string& path) {
  struct stat now {};
  if (::fstat(fd, &now) != 0) fail_errno(path);
  const bool other = now.st_uid != old.st_uid || now.st_gid != old.st_gid;
  if (other && ::fchown(fd, old.st_uid, old.st_gid) != 0 && errno != EPERM) fail_errno(path);
  // The new file is made with few rights and gets those of the old one before anything is written into it.
  if (::fchmod(fd, old.st_mode & kPermissions) != 0) fail_errno(path);
}

}  // namespace

void check_file_writable(const std::string& path) {
  const Names names(path);
  find_old(path);
  if (::faccessat(AT_FDCWD, names.folder.c_str(), W_OK | X_OK, AT_EACCESS) != 0) fail_errno(path);
}

void write_file_safely(const std::string& path, std::string_view text) {
  const Names names(path);
  const std::optional<struct stat> old = find_old(path);
  const Descriptor folder(::open(names.folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.get() < 0) fail_errno(path);
  ::unlink(names.fresh.c_str());  // of a process that was killed while it wrote
  // O_EXCL and O_NOFOLLOW: a link that somebody has put there in the meantime must not lead the writing
  // elsewhere.
  const Descriptor file(
      ::open(names.fresh.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, kNewFileMode));
  if (file.get() < 0) fail_errno(path);
  Temporary temporary(names.fresh);
  if (old) take_over(file.get(), *old, path);
  write_all(file.get(), text, path);
  // Before the rename, or a loss of power could leave the new name with an empty file. Up to the rename the
  // old file is whole.
  if (::fsync(file.get()) != 0) fail_errno(path);
  if (std::rename(names.fresh.c_str(), path.c_str()) != 0) fail_errno(path);
  // From here on the new file has the old one's name. The folder is synced as well, since the rename is an
  // entry in it.
  temporary.keep();
  if (::fsync(folder.get()) != 0 && errno != EINVAL) fail_errno(path);  // some file systems know no such sync
}

}  // namespace trn

#include "core/plain_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace trn {

namespace {

[[noreturn]] void cannot_read(int error) {
  throw PlainFileError(fmt::format("cannot read this file: {}", std::strerror(error)));
}

void refuse_folder(const struct stat& info) {
  if (S_ISDIR(info.st_mode)) throw PlainFileError("this is a folder; name a file in it");
}

void check_kind(const struct stat& info) {
  if (S_ISREG(info.st_mode)) return;
  refuse_folder(info);
  const char* kind = S_ISFIFO(info.st_mode) ? "a pipe" : S_ISSOCK(info.st_mode) ? "a socket" : "a device";
  throw PlainFileError(fmt::format("this is no regular file but {}; name a file on a disk", kind));
}

/// Closes at the end of its scope.
class ReadEnd {
 public:
  explicit ReadEnd(int fd) : fd_(fd) {}
  ~ReadEnd() { ::close(fd_); }
  ReadEnd(const ReadEnd&) = delete;
  ReadEnd& operator=(const ReadEnd&) = delete;

 private:
  int fd_;
};

// Counted while it is read: a file may grow, and those of /proc say that they are empty.
std::string read_to_end(int fd, std::size_t bytes_max) {
  constexpr std::size_t kPiece = std::size_t{1} << 16;
  std::string text;
  std::size_t size = 0;
  while (size <= bytes_max) {
    text.resize(size + kPiece);
    const ssize_t got = ::read(fd, text.data() + size, kPiece);
    if (got < 0 && errno != EINTR) cannot_read(errno);
    if (got > 0) size += static_cast<std::size_t>(got);
    if (got != 0) continue;
    text.resize(size);
    return text;
  }
  throw PlainFileError(fmt::format(
      "this file has more than {} MB, the most that is legal; is it the right one?", bytes_max >> 20));
}

void refuse_byte_0(const std::string& path) {
  if (path.find('\0') != std::string::npos) throw PlainFileError("a file's name has no byte 0");
}

}  // namespace

std::string read_plain_file(const std::string& path, std::size_t bytes_max) {
  refuse_byte_0(path);
  struct stat info {};
  // Asked before it is opened: a device may do something when it is opened.
  if (::stat(path.c_str(), &info) != 0) cannot_read(errno);
  check_kind(info);
  // Without O_NONBLOCK a pipe that has come in its place in the meantime would wait for its writer.
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (fd < 0) cannot_read(errno);
  const ReadEnd closes(fd);
  if (::fstat(fd, &info) != 0) cannot_read(errno);
  check_kind(info);
  return read_to_end(fd, bytes_max);
}

std::string read_named_file(const std::string& path) {
  constexpr std::size_t kBytesMax = std::size_t{1} << 32;
  try {
    refuse_byte_0(path);
    const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY);
    if (fd < 0) cannot_read(errno);
    const ReadEnd closes(fd);
    struct stat info {};
    if (::fstat(fd, &info) != 0) cannot_read(errno);
    refuse_folder(info);
    return read_to_end(fd, kBytesMax);
  } catch (const PlainFileError& error) {
    throw PlainFileError(fmt::format("{}: {}", path, error.what()));
  }
}

int open_to_write(const std::string& path, unsigned mode) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NONBLOCK | O_NOCTTY, mode);
  if (fd < 0 && errno == ENXIO)
    throw PlainFileError("this is a pipe or a socket that nobody reads; name a file on a disk");
  if (fd < 0) throw PlainFileError(fmt::format("cannot write this file: {}", std::strerror(errno)));
  // Only the opening must not wait.
  ::fcntl(fd, F_SETFL, ::fcntl(fd, F_GETFL) & ~O_NONBLOCK);
  return fd;
}

bool is_pipe(const std::string& path) {
  struct stat info {};
  return ::stat(path.c_str(), &info) == 0 && S_ISFIFO(info.st_mode);
}

}  // namespace trn

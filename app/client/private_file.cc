#include "app/client/private_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstring>
#include <string_view>

namespace trn {

namespace {

[[noreturn]] void refuse_file(const std::string& path, std::string_view why) {
  throw KeyError(fmt::format("{}: {}", path, why));
}

/// Closes at the end of its scope.
struct PrivateFile {
  int fd;
  ~PrivateFile() {
    if (fd >= 0) close(fd);
  }
};

}  // namespace

// Judged on the open file, so that what is read is what was judged.
std::string read_private_file(const std::string& path, std::size_t bytes_max, uid_t owner) {
  const PrivateFile file{open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK)};
  if (file.fd < 0)
    refuse_file(path, errno == ELOOP ? "is a link; name the key file itself" : std::strerror(errno));
  struct stat info {};
  if (fstat(file.fd, &info) != 0 || !S_ISREG(info.st_mode)) refuse_file(path, "is no key file");
  if (info.st_uid != owner && info.st_uid != 0) refuse_file(path, "belongs to another user");
  if (info.st_mode & (S_IRWXG | S_IRWXO))
    refuse_file(path,
                fmt::format("others can read or write this private key: chmod 600 {}; who may have read it "
                            "can use it, so make a new one if in doubt",
                            path));
  std::string text(bytes_max, '\0');
  const ssize_t size = ::read(file.fd, text.data(), text.size());
  if (size < 0 || static_cast<std::size_t>(size) == bytes_max) refuse_file(path, "is no key file");
  text.resize(static_cast<std::size_t>(size));
  return text;
}

}  // namespace trn

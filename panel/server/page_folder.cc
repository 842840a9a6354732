#include "panel/server/page_folder.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <utility>

namespace trn {

OpenFile::~OpenFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

OpenFile::OpenFile(OpenFile&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), size_(other.size_) {}

OpenFile& OpenFile::operator=(OpenFile&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(size_, other.size_);
  return *this;
}

int OpenFile::release() { return std::exchange(descriptor_, -1); }

bool OpenFile::read(std::uint64_t place, std::span<unsigned char> bytes) const {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t size =
        pread(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(place + done));
    if (size <= 0) return false;
    done += static_cast<std::size_t>(size);
  }
  return true;
}

// Part by part, as O_NOFOLLOW looks at the last part of a path alone. The folder itself may be a link: who
// started the panel named it.
std::optional<OpenFile> PageFolder::open(std::string_view file) const {
  OpenFile folder(::open(path_.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
  int at = folder.descriptor();
  for (std::size_t slash = file.find('/'); at >= 0 && slash != std::string_view::npos;
       slash = file.find('/')) {
    const std::string name(file.substr(0, slash));
    folder = OpenFile(openat(at, name.c_str(), O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    at = folder.descriptor();
    file.remove_prefix(slash + 1);
  }
  if (at < 0) return std::nullopt;
  // A pipe or a device must not make the server wait.
  OpenFile out(openat(at, std::string(file).c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  struct stat info {};
  if (out.descriptor() < 0 || fstat(out.descriptor(), &info) != 0 || !S_ISREG(info.st_mode))
    return std::nullopt;
  return OpenFile(out.release(), static_cast<std::uint64_t>(info.st_size));
}

}  // namespace trn

#include "app/session/line_file.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/plain_file.h"
#include "core/safe_file.h"

namespace trn {

namespace {

int open_lines(const std::string& path) {
  constexpr unsigned kMode = 0666;  // as the user's mask leaves it
  try {
    return open_to_write(path, kMode);
  } catch (const PlainFileError& error) {
    throw OutputError(fmt::format("{}: cannot write the session's log: {}", path, error.what()));
  }
}

}  // namespace

LineFile::LineFile(const std::string& path) : path_(path), fd_(open_lines(path)) {}

LineFile::~LineFile() { close(fd_); }

bool LineFile::write_all(std::string_view text) {
  while (!text.empty()) {
    const ssize_t done = ::write(fd_, text.data(), text.size());
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(done));
  }
  return true;
}

bool LineFile::put(std::string_view line) {
  const auto cut = [this] {
    const auto end = static_cast<off_t>(size_);
    return ftruncate(fd_, end) == 0 && lseek(fd_, end, SEEK_SET) == end;
  };
  if (torn_ && cut()) torn_ = false;
  if (torn_) return false;
  const std::string text = std::string(line) + "\n";
  if (write_all(text)) {
    size_ += text.size();
    return true;
  }
  why_ = std::strerror(errno);
  torn_ = !cut();
  return false;
}

}  // namespace trn

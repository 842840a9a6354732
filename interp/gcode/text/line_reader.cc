#include "interp/gcode/text/line_reader.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "interp/gcode/error.h"

namespace trn {

namespace {

constexpr std::size_t kChunk = 1U << 17;

class FileSource : public ByteSource {
 public:
  explicit FileSource(int descriptor) : descriptor_(descriptor) {}
  ~FileSource() override { ::close(descriptor_); }
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;

  std::size_t read(char* to, std::size_t size) override {
    for (;;) {
      const ssize_t got = ::read(descriptor_, to, size);
      if (got >= 0) return static_cast<std::size_t>(got);
      if (errno != EINTR) fail(GcodeErrorCode::kCannotOpen, 0, std::strerror(errno));
    }
  }
  bool seek(std::uint64_t offset) override {
    return ::lseek(descriptor_, static_cast<off_t>(offset), SEEK_SET) >= 0;
  }

 private:
  int descriptor_;
};

class TextSource : public ByteSource {
 public:
  explicit TextSource(std::string text) : text_(std::move(text)) {}
  std::size_t read(char* to, std::size_t size) override {
    const std::size_t count = std::min(size, text_.size() - at_);
    std::memcpy(to, text_.data() + at_, count);
    at_ += count;
    return count;
  }
  bool seek(std::uint64_t offset) override {
    at_ = std::min(static_cast<std::size_t>(offset), text_.size());
    return true;
  }

 private:
  std::string text_;
  std::size_t at_ = 0;
};

}  // namespace

std::unique_ptr<ByteSource> open_file(const std::string& path, bool may_be_missing) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0 && may_be_missing && (errno == ENOENT || errno == ENOTDIR)) return nullptr;
  if (descriptor < 0)
    fail(GcodeErrorCode::kCannotOpen, 0, fmt::format("'{}': {}", path, std::strerror(errno)));
  struct stat info {};
  // Opening a folder succeeds. Reading it would fail with a message that helps nobody.
  if (::fstat(descriptor, &info) == 0 && S_ISDIR(info.st_mode)) {
    ::close(descriptor);
    if (may_be_missing) return nullptr;
    fail(GcodeErrorCode::kCannotOpen, 0, fmt::format("'{}': it is a folder", path));
  }
  return std::make_unique<FileSource>(descriptor);
}

std::unique_ptr<ByteSource> text_source(std::string text) {
  return std::make_unique<TextSource>(std::move(text));
}

LineReader::LineReader(std::unique_ptr<ByteSource> source, std::size_t line_length_max)
    : source_(std::move(source)),
      line_length_max_(line_length_max),
      buffer_size_(line_length_max + kChunk),
      buffer_(new char[buffer_size_]) {}

// Moves what is left to the front and reads on; false when nothing new came.
bool LineReader::refill() {
  if (source_ended_) return false;
  // A line that lies across the end of the buffer comes to its front, so that every line is one piece of
  // memory.
  std::memmove(buffer_.get(), buffer_.get() + at_, end_ - at_);
  buffer_offset_ += at_;
  end_ -= at_;
  at_ = 0;
  const std::size_t got = source_->read(buffer_.get() + end_, buffer_size_ - end_);
  if (got == 0) source_ended_ = true;
  // Noted once for all that was read, so that lines of text are not searched for zeros each.
  has_zero_ = (has_zero_ && end_ > 0) || std::memchr(buffer_.get() + end_, '\0', got) != nullptr;
  end_ += got;
  return got > 0;
}

void LineReader::check_start() {
  const auto byte = [&](std::size_t i) { return i < end_ ? static_cast<unsigned char>(buffer_[i]) : 0U; };
  while (end_ < 4 && refill()) {
  }
  if (byte(0) == 0xEF && byte(1) == 0xBB && byte(2) == 0xBF) {
    at_ = 3;
    return;
  }
  // UTF-16 with its mark, or, without one, ASCII letters with zeros between them.
  const bool little =
      (byte(0) == 0xFF && byte(1) == 0xFE) || (end_ >= 4 && byte(0) && !byte(1) && byte(2) && !byte(3));
  const bool big =
      (byte(0) == 0xFE && byte(1) == 0xFF) || (end_ >= 4 && !byte(0) && byte(1) && !byte(2) && byte(3));
  if (little || big) {
    at_ = end_;
    // Read to the end, so that an error is told once and not for each line of it.
    while (refill()) at_ = end_;
    fail(GcodeErrorCode::kUtf16, 1, little ? "UTF-16LE" : "UTF-16BE");
  }
  const std::string_view text(buffer_.get(), end_);
  const std::size_t cr = text.find('\r');
  if (cr == text.npos || text.find('\n') != text.npos || text.find_first_not_of('\r', cr) == text.npos)
    return;
  // One line in all: behind a % or ; the whole program would be a comment.
  at_ = end_;
  while (refill()) at_ = end_;
  fail(GcodeErrorCode::kMacLineEnds, static_cast<std::uint32_t>(cr + 1));
}

bool LineReader::next(std::string_view& line) {
  if (buffer_offset_ == 0 && at_ == 0) check_start();
  std::size_t searched = 0;
  for (;;) {
    const char* start = buffer_.get() + at_;
    const auto* found = static_cast<const char*>(std::memchr(start + searched, '\n', end_ - at_ - searched));
    if (found) return finish_line(static_cast<std::size_t>(found - start), 1, line);
    // What was searched need not be searched again when more has come.
    searched = end_ - at_;
    if (searched > line_length_max_) overlong();
    if (refill()) continue;
    return searched > 0 && finish_line(searched, 0, line);
  }
}

bool LineReader::finish_line(std::size_t length, std::size_t step, std::string_view& line) {
  line = std::string_view(buffer_.get() + at_, length);
  at_ += length + step;
  ++line_;
  // The line is counted and passed before it is judged: the error names it, and reading goes on behind it.
  if (length > line_length_max_) fail(GcodeErrorCode::kLineTooLong, 1, line_length_max_);
  while (!line.empty() && line.back() == '\r') line.remove_suffix(1);  // "\r\r\n": written in text mode twice
  if (!has_zero_) return true;
  const std::size_t zero = line.find('\0');
  if (zero != std::string_view::npos) fail(GcodeErrorCode::kBinary, static_cast<std::uint32_t>(zero + 1), 0);
  return true;
}

// The rest of the line is read and thrown away, so that the next call goes on behind it.
void LineReader::overlong() {
  for (;;) {
    const char* start = buffer_.get() + at_;
    const auto* found = static_cast<const char*>(std::memchr(start, '\n', end_ - at_));
    at_ = found ? static_cast<std::size_t>(found - buffer_.get()) + 1 : end_;
    if (found || !refill()) break;
  }
  ++line_;
  fail(GcodeErrorCode::kLineTooLong, 1, line_length_max_);
}

bool LineReader::seek(const LinePlace& place) {
  if (place.offset >= buffer_offset_ && place.offset <= buffer_offset_ + end_) {
    at_ = static_cast<std::size_t>(place.offset - buffer_offset_);
  } else {
    if (!source_->seek(place.offset)) return false;
    buffer_offset_ = place.offset;
    at_ = end_ = 0;
    source_ended_ = false;
  }
  line_ = place.line;
  return true;
}

}  // namespace trn

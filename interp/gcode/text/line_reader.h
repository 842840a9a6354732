#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace trn {

/// Bytes that can be read again from any place.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  /// Fills up to `size` bytes from the current place; 0 at the end.
  virtual std::size_t read(char* to, std::size_t size) = 0;
  /// False when the input cannot go back (a pipe).
  virtual bool seek(std::uint64_t offset) = 0;
};

/// BlockError kCannotOpen, with the reason; null if `may_be_missing` and there is no file at `path`.
std::unique_ptr<ByteSource> open_file(const std::string& path, bool may_be_missing = false);
/// Whoever opens program files, in the manner of open_file.
using OpenFile = std::function<std::unique_ptr<ByteSource>(const std::string& path, bool may_be_missing)>;
std::unique_ptr<ByteSource> text_source(std::string text);

/// Where a line begins.
struct LinePlace {
  std::uint64_t offset = 0;
  std::uint32_t line = 1;  ///< 1-based
};

/// Splits a byte source into lines of bounded length with one fixed buffer. CRLF and a UTF-8 byte order mark
/// are taken off; UTF-16, binary data and overlong lines are BlockErrors (reading can go on with the next
/// line).
class LineReader {
 public:
  LineReader(std::unique_ptr<ByteSource> source, std::size_t line_length_max);

  /// The next line, valid until the next call; false at the end.
  bool next(std::string_view& line);
  /// Where the next line begins.
  LinePlace place() const { return {buffer_offset_ + at_, line_}; }
  /// Makes `place` the next line; false when the input cannot go back.
  bool seek(const LinePlace& place);

 private:
  bool refill();
  bool finish_line(std::size_t length, std::size_t step, std::string_view& line);
  [[noreturn]] void overlong();
  void check_start();

  std::unique_ptr<ByteSource> source_;
  std::size_t line_length_max_;
  std::size_t buffer_size_;
  std::unique_ptr<char[]> buffer_;
  std::uint64_t buffer_offset_ = 0;  ///< of buffer_[0] in the source
  std::size_t at_ = 0, end_ = 0;
  std::uint32_t line_ = 1;
  bool source_ended_ = false;
  bool has_zero_ = false;  ///< somewhere in the buffer
};

}  // namespace trn

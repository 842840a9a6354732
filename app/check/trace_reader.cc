#include "app/check/trace_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>

namespace trn {

namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;
constexpr std::size_t kLineBytesMax = std::size_t{1} << 16;

std::vector<std::string_view> split(std::string_view text) {
  std::vector<std::string_view> fields;
  for (;;) {
    const std::size_t comma = text.find(',');
    fields.push_back(text.substr(0, comma));
    if (comma == std::string_view::npos) return fields;
    text.remove_prefix(comma + 1);
  }
}

// Bytes of a damaged field, fit for a message.
std::string quoted(std::string_view text) {
  std::string out;
  for (const char c : text.substr(0, 24))
    out +=
        (c >= 0x20 && c < 0x7f) ? std::string(1, c) : fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
  return fmt::format("'{}{}'", out, text.size() > 24 ? "..." : "");
}

WrittenDigits digits_of(std::string_view text) {
  const std::size_t e = text.find_first_of("eE");
  const std::string_view mantissa = text.substr(0, e);
  const std::size_t point = mantissa.find('.');
  WrittenDigits written;
  written.decimals = point == std::string_view::npos ? 0 : static_cast<int>(mantissa.size() - point - 1);
  if (e != std::string_view::npos) {
    std::string_view digits = text.substr(e + 1);
    if (digits.starts_with('+')) digits.remove_prefix(1);
    int exponent = 0;
    std::from_chars(digits.data(), digits.data() + digits.size(), exponent);
    // 1.5e-3 has four decimals: one behind the point and three by the exponent.
    written.decimals -= exponent;
  }
  const std::size_t first = mantissa.find_first_of("123456789");
  if (first == std::string_view::npos) return written;
  const bool point_behind = point != std::string_view::npos && point > first;
  written.significant = static_cast<int>(mantissa.size() - first) - (point_behind ? 1 : 0);
  return written;
}

}  // namespace

void TraceReader::Close::operator()(std::FILE* file) const {
  if (file != stdin) std::fclose(file);
}

TraceReader::TraceReader(const std::string& path, const std::vector<std::string>& wanted)
    : path_(path), file_(path == "-" ? stdin : std::fopen(path.c_str(), "rb")), buffer_(kBufferBytes) {
  if (!file_) throw TraceError(fmt::format("{}:1:1: cannot read this file: {}", path, std::strerror(errno)));
  read_header(wanted);
}

TraceError TraceReader::error(std::size_t column, std::string_view message) const {
  return TraceError(
      fmt::format("{}:{}:{}: {}", path_, std::max<std::uint64_t>(trace_line_, 1), column, message));
}

bool TraceReader::refill() {
  std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(begin_),
            buffer_.begin() + static_cast<std::ptrdiff_t>(end_), buffer_.begin());
  end_ -= begin_;
  begin_ = 0;
  const std::size_t got = std::fread(buffer_.data() + end_, 1, buffer_.size() - end_, file_.get());
  if (std::ferror(file_.get())) throw error(1, fmt::format("cannot read on: {}", std::strerror(errno)));
  end_ += got;
  return got > 0;
}

// A row that does not end in a line end was cut off: its last number may lack digits.
bool TraceReader::read_line(std::string_view& text) {
  const char* newline = nullptr;
  std::size_t seen = 0;
  for (;;) {
    const char* from = buffer_.data() + begin_;
    const std::size_t size = end_ - begin_;
    if (size > seen) newline = static_cast<const char*>(std::memchr(from + seen, '\n', size - seen));
    // A file without line ends, such as a binary one, must not be read into memory whole.
    if (newline || size > kLineBytesMax) break;
    seen = size;
    if (refill()) continue;
    if (end_ == begin_) return false;
    ++trace_line_;
    throw error(1, "the trace was cut off here: this row has no line end");
  }
  ++trace_line_;
  const char* from = buffer_.data() + begin_;
  const std::size_t length = newline ? static_cast<std::size_t>(newline - from) : kLineBytesMax + 1;
  if (length > kLineBytesMax)
    throw error(1, fmt::format("a row of more than {} bytes: this is not a trace", kLineBytesMax));
  text = std::string_view(from, length);
  if (text.ends_with('\r')) text.remove_suffix(1);
  begin_ += length + 1;
  return true;
}

void TraceReader::read_header(const std::vector<std::string>& wanted) {
  std::string_view text;
  if (!read_line(text)) throw error(1, "the trace is empty; a header row is expected");
  std::size_t column = 1;
  std::vector<int> found(wanted.size(), 0);
  for (const std::string_view name : split(text)) {
    const auto at = std::find(wanted.begin(), wanted.end(), name);
    int role = kOther;
    if (name == "t_s") role = kTime;
    if (name == "line") role = kLine;
    if (name == "piece") role = kPiece;
    if (at != wanted.end()) role = static_cast<int>(at - wanted.begin());
    if (role >= 0 && ++found[static_cast<std::size_t>(role)] > 1)
      throw error(column, fmt::format("two columns are named {}", quoted(name)));
    // The time first and once: a table of something else is not taken for a trace.
    if ((column == 1) != (role == kTime))
      throw error(column, fmt::format("column 1 must be 't_s', and no other; here stands {}", quoted(name)));
    role_.push_back(role);
    column += name.size() + 1;
  }
  column_count_ = role_.size();
  joint_count_ = wanted.size();
  for (std::size_t i = 0; i < wanted.size(); ++i)
    if (!found[i])
      throw error(1, fmt::format("no column for joint '{}'; the header must name it", wanted[i]));
}

double TraceReader::field(std::string_view text, std::size_t column) const {
  double value = 0;
  const auto [rest, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc{} || rest != text.data() + text.size() || !std::isfinite(value))
    throw error(column, fmt::format("{} is not a finite number", quoted(text)));
  return value;
}

bool TraceReader::next(TraceRow& row) {
  std::string_view text;
  if (!read_line(text)) return false;
  row.q.resize(joint_count_);
  row.digits.resize(joint_count_);
  const char* const start = text.data();
  for (std::size_t i = 0; i < column_count_; ++i) {
    const std::size_t comma = text.find(',');
    const std::size_t column = static_cast<std::size_t>(text.data() - start) + 1;
    if ((comma == std::string_view::npos) != (i + 1 == column_count_))
      throw error(column, fmt::format("this row does not have the {} fields of the header", column_count_));
    const std::string_view token = text.substr(0, comma);
    const double value = field(token, column);
    if (role_[i] == kTime) row.t_s = value;
    if (role_[i] == kPiece) row.piece = value;
    if (role_[i] == kLine) row.line = static_cast<std::uint32_t>(std::clamp(value, 0.0, 4294967295.0));
    if (role_[i] >= 0) {
      row.q[static_cast<std::size_t>(role_[i])] = value;
      row.digits[static_cast<std::size_t>(role_[i])] = digits_of(token);
    }
    if (comma != std::string_view::npos) text.remove_prefix(comma + 1);
  }
  return true;
}

}  // namespace trn

#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace trn {

/// A trace that cannot be judged; what() is "file:line:column: message".
struct TraceError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// How many digits of a number were written.
struct WrittenDigits {
  int decimals = -400;  ///< behind the decimal point: 3 for "1.250", 5 for "1.2e-4", -2 for "1e2"
  int significant = 0;  ///< from the first that is not 0: 4 for "1.250", 2 for "0.0012"
};

/// One row of a trace. Values stand in the order of the columns asked for.
struct TraceRow {
  double t_s = 0;
  std::vector<double> q;  ///< mm or rad, as recorded
  std::vector<WrittenDigits> digits;
  std::uint32_t line = 0;  ///< source line of the program; 0 where the trace has no such column
  double piece = 0;        ///< of a recording that is in pieces; 0 where the trace has no such column
};

/// Reads a setpoint trace (CSV: a header, then one row a period) as a stream, in memory that does not grow
/// with its length. Every field of every row must be a finite number. Columns: t_s first, then any, found by
/// name.
class TraceReader {
 public:
  /// Opens `path` ("-" is standard input) and reads the header; every name of `wanted` must be a column of
  /// it.
  TraceReader(const std::string& path, const std::vector<std::string>& wanted);

  /// Next row; false at the end of the trace. TraceError when the trace is damaged.
  bool next(TraceRow& row);

  /// An error at the line of the trace (1-based) that was read last.
  TraceError error(std::size_t column, std::string_view message) const;

 private:
  struct Close {
    void operator()(std::FILE* file) const;
  };

  bool read_line(std::string_view& text);
  bool refill();
  void read_header(const std::vector<std::string>& wanted);
  double field(std::string_view text, std::size_t column) const;

  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0, end_ = 0;
  std::uint64_t trace_line_ = 0;
  std::size_t column_count_ = 0;
  static constexpr int kTime = -1, kLine = -2, kPiece = -3, kOther = -4;
  std::size_t joint_count_ = 0;
  std::vector<int> role_;  // per column: index into `wanted`, or one of the above
};

}  // namespace trn

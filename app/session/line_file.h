#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace trn {

/// A file that grows by whole lines. Of one that cannot be written, as on a full disk, nothing stays, so that
/// all that is there can be read.
class LineFile {
 public:
  /// Emptied, or made anew. std::runtime_error if it cannot be written.
  explicit LineFile(const std::string& path);
  ~LineFile();
  LineFile(const LineFile&) = delete;
  LineFile& operator=(const LineFile&) = delete;

  /// `line`, and its end. False if it could not be written; the next one may.
  bool put(std::string_view line);
  /// Why the last line that could not be written was not.
  const std::string& why() const { return why_; }
  const std::string& path() const { return path_; }

 private:
  bool write_all(std::string_view text);

  std::string path_, why_;
  int fd_;
  std::size_t size_ = 0;  ///< of the whole lines
  bool torn_ = false;     ///< part of a line is behind them
};

}  // namespace trn

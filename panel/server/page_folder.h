#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace trn {

/// An open file, read piece by piece.
class OpenFile {
 public:
  /// Takes the descriptor over.
  explicit OpenFile(int descriptor, std::uint64_t size = 0) : descriptor_(descriptor), size_(size) {}
  ~OpenFile();
  OpenFile(OpenFile&& other) noexcept;
  OpenFile& operator=(OpenFile&& other) noexcept;

  int descriptor() const { return descriptor_; }  ///< below 0: it could not be opened
  std::uint64_t size() const { return size_; }
  int release();  ///< the caller closes it
  /// Fills `bytes` with those from `place` on; false if they are not there (any more).
  bool read(std::uint64_t place, std::span<unsigned char> bytes) const;

 private:
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

/// The folder whose files everybody may have who reaches the panel. No link is followed below it.
class PageFolder {
 public:
  explicit PageFolder(std::string path) : path_(std::move(path)) {}

  /// A regular file by its path in the folder, as `page_file` makes it; nothing where there is none, or a
  /// link stands on the way.
  std::optional<OpenFile> open(std::string_view file) const;

 private:
  std::string path_;
};

}  // namespace trn

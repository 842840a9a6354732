#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace trn {

/// A file that cannot be written; what() is "path: why; what would help".
struct FileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A file that somebody asked for, as a trace or a report, and that cannot be written; what() is "path: why".
struct OutputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Replaces the whole file `path` with `text` so that after a kill or a power cut at any moment either the
/// old or the new content is there: writes ".NAME.new" in the same folder, fsync, rename, fsync of the
/// folder. When this returns, the text is on the disk. A new file gets mode 0640, one that is replaced keeps
/// its mode and, as far as the system allows, its owner. FileError, with the old file untouched, if the disk
/// is full, the folder cannot be written, or `path` is read-only (also for root), a link or no regular file.
/// One exception: a disk that fails while the folder is synced, as the last step, leaves the new content with
/// a FileError, and after a power cut the old or the new.
void write_file_safely(const std::string& path, std::string_view text);

/// Throws as `write_file_safely` would for what can be known beforehand; writes nothing.
void check_file_writable(const std::string& path);

}  // namespace trn

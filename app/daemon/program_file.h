#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "interp/gcode/program_config.h"
#include "interp/gcode/text/line_reader.h"

namespace trn {

/// How files are opened and read; tests put files that never answer in place of the system's.
struct FileCalls {
  std::function<int(const char* path)> open;  ///< a descriptor, or -1 with errno
  std::function<ssize_t(int fd, char* to, std::size_t size, std::uint64_t offset)> read;
  static FileCalls of_system();
};

/// Opens program files for the daemon: regular files only, and only programs. Every call to the file system
/// is made in a thread of the file's own, which is left behind if the call does not come back in time (a
/// share that is gone): reading may fail, but never hangs.
class ProgramFiles {
 public:
  static constexpr int kStuckMax = 16;  ///< threads that may have been left behind

  /// Reading ends within 50 ms with an error when `*given_up` becomes true. `words` as in ProgramConfig. Both
  /// must outlive the files.
  ProgramFiles(const std::atomic<bool>& given_up, const std::vector<MappedWord>& words, double patience_s = 5,
               FileCalls calls = FileCalls::of_system());

  /// As open_file; BlockError kCannotOpen for what is no regular file, kNotProgram for other texts.
  std::unique_ptr<ByteSource> open(const std::string& path, bool may_be_missing) const;

 private:
  const std::atomic<bool>& given_up_;
  const std::vector<MappedWord>& words_;
  double patience_s_;
  FileCalls calls_;
  std::shared_ptr<std::atomic<int>> stuck_;
};

/// False if `head`, the beginning of a file, has lines with more than comments, and none of the first hundred
/// of them is G-code.
bool may_be_program(std::string_view head, const std::vector<MappedWord>& words);

}  // namespace trn

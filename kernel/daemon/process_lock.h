#pragma once

#include <string>

namespace trn {

/// Holds the machine for this process: a lock file, named after the machine, in /run, $XDG_RUNTIME_DIR or
/// /tmp, the first that can be written. The kernel frees the lock when the process ends, however it ends.
class ProcessLock {
 public:
  /// std::runtime_error with the holder's process id if another process has it.
  explicit ProcessLock(const std::string& machine);
  ~ProcessLock();
  ProcessLock(const ProcessLock&) = delete;
  ProcessLock& operator=(const ProcessLock&) = delete;

 private:
  int fd_;
};

}  // namespace trn

#pragma once

#include <string>
#include <vector>

namespace trn {

/// Holds the machine for this process: a lock file, named after the machine, in a folder where nobody else
/// can put one first. The kernel frees the lock when the process ends, however it ends.
class ProcessLock {
 public:
  /// std::runtime_error with the holder's process id if another process has it.
  explicit ProcessLock(const std::string& machine);
  ProcessLock(const std::string& machine, const std::vector<std::string>& folders);
  ~ProcessLock();
  ProcessLock(const ProcessLock&) = delete;
  ProcessLock& operator=(const ProcessLock&) = delete;

 private:
  int fd_;
};

}  // namespace trn

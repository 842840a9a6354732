#pragma once

#include <string>
#include <vector>

namespace trn {

/// Keeps the daemons of other machines from a file that this one changes (variables, tools): each would write
/// over what the other has acknowledged. A lock file beside it, FILE.lock, which stays.
class TableLock {
 public:
  /// For the machine of this name; `path` "": for nothing. std::runtime_error with the holder if another
  /// process has it.
  TableLock(const std::string& path, const std::string& machine);
  ~TableLock();
  TableLock(const TableLock&) = delete;
  TableLock& operator=(const TableLock&) = delete;

  /// Why there is no lock, where none can be made, as in a folder that cannot be written; "": there is one,
  /// or none is needed.
  const std::string& missing() const { return missing_; }

 private:
  int fd_ = -1;
  std::string missing_;
};

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

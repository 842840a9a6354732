#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace trn {

/// Folders for the locks of this process's machines, best first: $RUNTIME_DIRECTORY (a service's own),
/// /run/trunnion, $XDG_RUNTIME_DIR, ~/.local/state/trunnion, /tmp/trunnion-UID.
std::vector<std::string> lock_folders();

/// The first of the folders that is, or can be made, one that only this user (or root) can write: a folder
/// and no link. std::runtime_error with what is wrong with each if there is none.
std::string private_folder(const std::vector<std::string>& folders);

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

/// True for users whose word counts on this host: root, this process's own, and those to whom root gave a
/// folder in /run/trunnion (the services' users).
bool is_trusted_user(uid_t user);

}  // namespace trn

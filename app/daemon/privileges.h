#pragma once

#include <string>
#include <vector>

namespace trn {

/// What a process keeps when it gives up all else.
struct Rights {
  std::vector<std::string> write_folders;  ///< files are written, made and removed there, and in /dev
  bool real_time =
      true;  ///< capabilities for priority, locked memory and a CAN controller's restart; else none
  bool sockets = true;     ///< new ones: local, IP, CAN and the kernel's own; else none
  bool processes = false;  ///< new ones, of the same program
};

/// What this process may do to its host from now on, and with it every thread and process that it begins
/// later; there is no way back. Must be called before other threads exist.
///
/// - Capabilities: root itself has no more than those, so that it reads and writes what its files' rights
/// allow.
/// - Files: written, made and removed in the folders named alone (Landlock); read as before.
/// - System calls: no new programs, no look into others, no mounts, modules, clocks and namespaces, nor what
/// `rights`
///   leaves out (seccomp). Such a call fails with EPERM.
///
/// Returns what this host's kernel could not do, one sentence each.
std::vector<std::string> give_up_privileges(const Rights& rights);

}  // namespace trn

#pragma once

#include <string>
#include <vector>

namespace trn {

/// What a daemon may do to its host from now on, and with it every thread and program that it begins later;
/// there is no way back. Must be called before other threads exist.
///
/// - Capabilities: those for real-time priority, locked memory and a CAN controller's restart; root itself
/// has
///   no more, so that it reads and writes what its files' rights allow.
/// - Files: written, made and removed in `write_folders` and in /dev alone (Landlock); read as before.
/// - System calls: no new programs and processes, no look into others, no mounts, modules, clocks and
/// namespaces,
///   no sockets but local ones, IP, CAN and the kernel's own (seccomp). Such a call fails with EPERM.
///
/// Returns what this host's kernel could not do, one sentence each.
std::vector<std::string> give_up_privileges(const std::vector<std::string>& write_folders);

}  // namespace trn

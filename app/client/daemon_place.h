#pragma once

#include <sys/types.h>

#include <memory>
#include <string>
#include <vector>

#include "app/client/access_config.h"
#include "hal/local_socket.h"

namespace trn {

/// Folders for the locks of this process's machines, best first: $RUNTIME_DIRECTORY (a service's own),
/// /run/trunnion, $XDG_RUNTIME_DIR, ~/.local/state/trunnion, /tmp/trunnion-UID.
std::vector<std::string> lock_folders();

/// The first of the folders that is, or can be made, one that only this user (or root) can write: a folder
/// and no link. std::runtime_error with what is wrong with each if there is none.
std::string private_folder(const std::vector<std::string>& folders);

/// The name of the machine's socket in such a folder.
std::string socket_name(const std::string& machine);
/// Beside a daemon's socket: another one, for who finds no room at the first. What it hears there is obeyed
/// where it makes the machine safer, and refused else.
std::string safety_socket(const std::string& socket);
/// Where a client of this machine looks for the daemon's socket, best first.
std::vector<std::string> sockets_to_try(const AccessConfig& config, const std::string& machine);

/// A socket of some daemon, or what one has left.
struct SocketPlace {
  std::string machine, path;
};
/// All of them where clients look whose config names no socket of its own, best first.
std::vector<SocketPlace> sockets_there();

/// True for users whose word counts on this host: root, this process's own, and those to whom root gave a
/// folder in /run/trunnion (the services' users).
bool is_trusted_user(uid_t user);

/// An attempt to reach the daemon of a machine.
struct Connection {
  std::unique_ptr<LocalClient> link;  ///< null: nobody whom this user trusts listens
  std::string refused;                ///< why, where that will not mend itself; else ""
};
/// Tries the sockets of `sockets_to_try` once, or those beside them.
Connection connect_to_daemon(const AccessConfig& config, const std::string& machine, bool safety = false);

/// For people: what is so when a daemon ends a connection.
inline constexpr const char* kConnectionEnded =
    "has ended the connection: it ends itself, or it has no room for another client (24 of one user, 64 of "
    "all; "
    "close one). 'stop', 'hold' and 'estop' get through all the same";

}  // namespace trn

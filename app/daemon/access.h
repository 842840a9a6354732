#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "app/session/access_config.h"
#include "hal/local_socket.h"

namespace trn {

/// What somebody may do. Each role may do what those before it may.
enum class Role : std::uint8_t {
  kLook,     ///< see state and motion; stop the machine
  kOperate,  ///< move it: programs, MDI, jog, home, overrides, reset, sensor readings
  kSetUp,    ///< change how it moves: switch corrections
  kCount
};
std::string_view to_string(Role role);

/// Who may do what, by the groups of this host. Root and the daemon's own user may do everything.
class AccessRules {
 public:
  explicit AccessRules(const AccessConfig& config);

  /// The group that the socket belongs to; -1: the host does not know it, and the socket is the daemon's own.
  gid_t socket_group() const { return groups_[0]; }
  bool allows(const Peer& peer, Role role) const;
  /// Why not, and who could change it.
  std::string refusal(const Peer& peer, Role role) const;
  /// What of the config cannot be kept on this host; one sentence each.
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  std::string names_[static_cast<std::size_t>(Role::kCount)];
  gid_t groups_[static_cast<std::size_t>(Role::kCount)];  // -1: no such group
  std::vector<std::string> warnings_;
};

/// Where the daemon of this machine makes its socket; the folder is given to the socket's group (-1: none).
/// std::runtime_error if no folder will do.
std::string socket_to_make(const AccessConfig& config, const std::string& machine, gid_t group);
/// Where a client of this machine looks for it, best first.
std::vector<std::string> sockets_to_try(const AccessConfig& config, const std::string& machine);

}  // namespace trn

#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "app/client/access_config.h"
#include "app/client/command_rights.h"
#include "hal/local_socket.h"

namespace trn {

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

}  // namespace trn

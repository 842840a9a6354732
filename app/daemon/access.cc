#include "app/daemon/access.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "app/client/daemon_place.h"
#include "core/accounts.h"
#include "hal/local_socket.h"

namespace trn {

namespace {

constexpr auto kNobody = static_cast<gid_t>(-1);

}  // namespace

AccessRules::AccessRules(const AccessConfig& config) : names_{config.look, config.operate, config.set_up} {
  for (std::size_t i = 0; i < std::size(names_); ++i) {
    if (i > 0 && names_[i].empty()) names_[i] = names_[i - 1];
    groups_[i] = group_id(names_[i]).value_or(kNobody);
    const bool told = i > 0 && names_[i] == names_[i - 1];
    if (groups_[i] == kNobody && !told)
      warnings_.push_back(
          fmt::format("this host has no group '{}': nobody but root and this user may {} (make it "
                      "with: groupadd --system {})",
                      names_[i], to_string(static_cast<Role>(i)), names_[i]));
  }
}

// A role needs its own group and those of the roles before it.
bool AccessRules::allows(const Peer& peer, Role role) const {
  if (peer.uid == 0 || peer.uid == geteuid()) return true;
  for (std::size_t i = 0; i <= static_cast<std::size_t>(role); ++i)
    if (groups_[i] == kNobody || !peer.is_in(groups_[i])) return false;
  return true;
}

std::string AccessRules::refusal(const Peer& peer, Role role) const {
  const std::string& name = names_[static_cast<std::size_t>(role)];
  return fmt::format("{} may not {} this machine: that needs group '{}' (usermod -aG {} {})", peer.user,
                     to_string(role), name, name, peer.user);
}

// The group must be able to reach the socket; whoever may not give it the folder has one that only he can
// enter.
std::string socket_to_make(const AccessConfig& config, const std::string& machine, gid_t group) {
  if (!config.socket.empty()) return config.socket;
  const std::string folder = private_folder(lock_folders());
  const bool given = group == kNobody || give_to_group(folder, group);
  if (!given) spdlog::info("{}: group '{}' cannot enter this folder", folder, config.look);
  return fmt::format("{}/{}", folder, socket_name(machine));
}

}  // namespace trn

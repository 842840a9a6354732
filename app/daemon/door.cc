#include "app/daemon/door.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <stdexcept>
#include <system_error>

namespace trn {

namespace {

// Where another daemon listens, the lock was in another folder: of another user, or by another environment.
void refuse_second_daemon(const std::string& machine, const AccessConfig& config) {
  for (const std::string& path : sockets_to_try(config, machine)) {
    try {
      const LocalClient other(path);
      if (is_trusted_user(other.server().uid))
        throw std::runtime_error(
            fmt::format("machine '{}' is already run: {} listens at {}; stop that one first", machine,
                        other.server().text(), path));
    } catch (const std::system_error&) {  // nobody listens there
    }
  }
}

std::string socket_path(const std::string& machine, const AccessConfig& config, const AccessRules& rules) {
  for (const std::string& warning : rules.warnings()) spdlog::info("{}", warning);
  refuse_second_daemon(machine, config);
  return socket_to_make(config, machine, rules.socket_group());
}

}  // namespace

Door::Door(const std::string& machine, const AccessConfig& config)
    : lock_(machine),
      access_(config),
      clients_(socket_path(machine, config, access_), access_.socket_group()) {
  try {
    safety_.emplace(safety_socket(clients_.path()), access_.socket_group(),
                    LocalServer::WhenFull::kDropOldest);
  } catch (const std::exception& error) {
    spdlog::warn("clients beyond the number that is served cannot even stop the machine: {}", error.what());
  }
}

}  // namespace trn

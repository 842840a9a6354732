#include "app/daemon/door.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <exception>
#include <stdexcept>
#include <utility>

#include "app/daemon/listener.h"

namespace trn {

namespace {

constexpr auto kLookEvery = std::chrono::seconds(1);
constexpr auto kTryAgain = std::chrono::seconds(10);

// Where another daemon listens, the lock was in another folder: of another user, or by another environment.
// Whoever listens where the config says that this machine's socket is, is one, too.
void refuse_second_daemon(const std::string& machine, const AccessConfig& config) {
  for (const std::string& path : sockets_to_try(config, machine)) {
    const std::optional<Listener> other = listener_at(path);
    if (!other || !(is_trusted_user(other->uid) || path == config.socket)) continue;
    throw std::runtime_error(fmt::format("machine '{}' is already run: {} listens at {}; stop that one first",
                                         machine, other->text, path));
  }
}

// Without the right to give the file away, which a daemon of root gives up, clients of its group stay
// outside.
void listen_anew(LocalServer& server, gid_t group) {
  try {
    return server.listen_anew(group);
  } catch (const std::exception& error) {
    if (group == static_cast<gid_t>(-1)) throw;
    spdlog::error("{}; until the daemon is started again, only its own user can connect", error.what());
  }
  server.listen_anew(static_cast<gid_t>(-1));
}

// What keeps clients out; "": nothing does.
std::string keep_open(LocalServer& server, gid_t group) {
  if (server.holds_path()) return "";
  if (const std::optional<Listener> other = listener_at(server.path()))
    return fmt::format(
        "{} was removed, and {} listens there now: clients command that one; end both, then start one of "
        "them",
        server.path(), other->text);
  try {
    listen_anew(server, group);
  } catch (const std::exception& error) {
    return fmt::format("{} was removed, and no client finds the daemon any more: {}; start it again",
                       server.path(), error.what());
  }
  spdlog::warn("{} was removed; clients find it again", server.path());
  return "";
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

std::string Door::look(std::chrono::steady_clock::time_point now) {
  if (now < next_look_) return "";
  std::string trouble = keep_open(clients_, access_.socket_group());
  if (std::string more = safety_ ? keep_open(*safety_, access_.socket_group()) : ""; trouble.empty())
    trouble = std::move(more);
  next_look_ = now + (trouble.empty() ? kLookEvery : kTryAgain);
  const bool news = trouble != told_;
  told_ = trouble;
  return news ? trouble : "";
}

}  // namespace trn

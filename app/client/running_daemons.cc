#include "app/client/running_daemons.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sodium.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <system_error>

#include "app/client/daemon_line.h"
#include "app/client/daemon_place.h"
#include "hal/lcm_messages.h"
#include "hal/local_socket.h"

namespace trn {

namespace {

// A daemon that has just been asked tells its status at once; one that hangs keeps nobody longer.
constexpr auto kPatience = std::chrono::milliseconds(500);

std::optional<RunningDaemon> ask(const SocketPlace& place) {
  try {
    LocalClient link(place.path);
    if (!is_trusted_user(link.server().uid)) return std::nullopt;
    std::optional<RunningDaemon> found;
    link.subscribe<trunnion::status_t>(place.machine + ".status", [&](const trunnion::status_t& status) {
      found = {place.machine, status.config_file};
    });
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (!found && !link.closed() && std::chrono::steady_clock::now() < end) link.handle(20);
    return found;
  } catch (const std::system_error&) {  // nobody listens there, or not to us
    return std::nullopt;
  }
}

}  // namespace

std::vector<RunningDaemon> find_daemons() {
  std::vector<RunningDaemon> out;
  for (const SocketPlace& place : sockets_there()) {
    const auto is_same = [&](const RunningDaemon& known) { return known.machine == place.machine; };
    if (std::any_of(out.begin(), out.end(), is_same)) continue;
    if (auto daemon = ask(place)) out.push_back(std::move(*daemon));
  }
  return out;
}

std::string config_of_daemon(const std::string& machine) {
  const std::vector<RunningDaemon> daemons = find_daemons();
  std::vector<std::string> names;
  for (const RunningDaemon& daemon : daemons) {
    if (daemon.machine == machine || (machine.empty() && daemons.size() == 1)) return daemon.config_file;
    names.push_back(daemon.machine);
  }
  if (names.empty())
    throw NoAnswer(
        "no daemon runs here that this user may ask; start one with 'trunnion daemon --machine CONFIG'");
  if (machine.empty())
    throw NoAnswer(fmt::format("daemons of {} machines run here; say which with --machine: {}", names.size(),
                               fmt::join(names, ", ")));
  throw NoAnswer(fmt::format("'{}' is neither a file nor a machine whose daemon runs here; those are: {}",
                             machine, fmt::join(names, ", ")));
}

std::string file_mark(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return "";
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  std::array<unsigned char, crypto_generichash_BYTES_MIN> hash{};
  crypto_generichash(hash.data(), hash.size(), reinterpret_cast<const unsigned char*>(text.data()),
                     text.size(), nullptr, 0);
  std::string out;
  for (std::size_t i = 0; i < 8; ++i) out += fmt::format("{:02x}", hash[i]);
  return out;
}

}  // namespace trn

#include "app/client/running_daemons.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sodium.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <optional>
#include <system_error>

#include "app/client/daemon_line.h"
#include "app/client/daemon_place.h"
#include "hal/lcm_messages.h"
#include "hal/local_socket.h"

namespace trn {

namespace {

// A daemon that has just been asked tells its status at once; one that hangs keeps nobody longer than clients
// wait.
constexpr auto kPatience = std::chrono::seconds(2);

/// `full`: it runs, but has no room for another client.
struct Asked {
  std::optional<RunningDaemon> daemon;
  bool full = false;
};

Asked ask_at(const std::string& path, const std::string& machine) {
  try {
    LocalClient link(path);
    if (!is_trusted_user(link.server().uid)) return {};
    std::optional<RunningDaemon> found;
    link.subscribe<trunnion::status_t>(machine + ".status", [&](const trunnion::status_t& status) {
      found = {machine, status.config_file};
    });
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (!found && !link.closed() && std::chrono::steady_clock::now() < end) link.handle(20);
    return {found, !found && link.closed()};
  } catch (const std::system_error&) {  // nobody listens there, or not to us
    return {};
  }
}

Asked ask(const SocketPlace& place) {
  const Asked asked = ask_at(place.path, place.machine);
  if (!asked.full) return asked;
  return {ask_at(safety_socket(place.path), place.machine).daemon, true};
}

}  // namespace

std::vector<RunningDaemon> find_daemons() {
  std::vector<RunningDaemon> out;
  for (const SocketPlace& place : sockets_there()) {
    const auto is_same = [&](const RunningDaemon& known) { return known.machine == place.machine; };
    if (std::any_of(out.begin(), out.end(), is_same)) continue;
    if (auto asked = ask(place); asked.daemon) out.push_back(std::move(*asked.daemon));
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
  for (const SocketPlace& place : names.empty() ? sockets_there() : std::vector<SocketPlace>())
    if ((machine.empty() || machine == place.machine) && ask(place).full)
      throw NoAnswer(fmt::format("the daemon of machine '{}' {}", place.machine, kConnectionEnded));
  if (names.empty())
    throw NoAnswer(
        "no daemon runs here that this user may ask; start one with 'trunnion daemon --machine CONFIG'");
  if (machine.empty())
    throw NoAnswer(fmt::format("daemons of {} machines run here; say which with --machine: {}", names.size(),
                               fmt::join(names, ", ")));
  throw NoAnswer(fmt::format("'{}' is neither a file nor a machine whose daemon runs here; those are: {}",
                             machine, fmt::join(names, ", ")));
}

// A program may be longer than the memory is large.
std::string file_mark(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return "";
  crypto_generichash_state state{};
  std::array<unsigned char, crypto_generichash_BYTES_MIN> hash{};
  crypto_generichash_init(&state, nullptr, 0, hash.size());
  std::vector<char> bytes(std::size_t{1} << 16);
  while (file.read(bytes.data(), static_cast<std::streamsize>(bytes.size())), file.gcount() > 0)
    crypto_generichash_update(&state, reinterpret_cast<const unsigned char*>(bytes.data()),
                              static_cast<unsigned long long>(file.gcount()));
  crypto_generichash_final(&state, hash.data(), hash.size());
  std::string out;
  for (std::size_t i = 0; i < 8; ++i) out += fmt::format("{:02x}", hash[i]);
  return out;
}

}  // namespace trn

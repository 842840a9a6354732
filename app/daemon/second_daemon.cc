#include "app/daemon/second_daemon.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <optional>
#include <set>
#include <stdexcept>

#include "app/daemon/process_lock.h"
#include "hal/socket_owner.h"
#include "hal/udp_group.h"

namespace trn {

namespace {

constexpr auto kListen = std::chrono::milliseconds(350);  // three status messages

/// Whose status counts. Beyond this host nobody can be told apart, and each one does.
class StatusJudge {
 public:
  explicit StatusJudge(bool this_host) : this_host_(this_host) {}

  bool counts(const WireSender& sender) {
    if (!this_host_) return true;
    const std::optional<uid_t> owner = owner_of_port(sender.port);
    if (owner && is_trusted_user(*owner)) return true;
    if (told_.size() < kToldMax && told_.insert(sender).second)
      spdlog::warn("{} (port {}) sends a status in this machine's name: nobody here trusts it",
                   owner ? fmt::format("user {}", *owner) : std::string("an unknown user"), sender.port);
    return false;
  }

 private:
  static constexpr std::size_t kToldMax = 3;
  bool this_host_;
  std::set<WireSender> told_;
};

}  // namespace

void refuse_second_daemon(const LcmConfig& config) {
  if (config.url.rfind("udpm://", 0) != 0) return;
  StatusJudge judge(UdpAddress::parse(config.url).stays_here());
  LcmLink link(config.url);
  std::optional<trunnion::status_t> heard;
  link.subscribe<trunnion::status_t>(config.status_channel(), [&](const auto& status) {
    if (!heard && judge.counts(link.sender())) heard = status;
  });
  const auto end = std::chrono::steady_clock::now() + kListen;
  while (!heard && std::chrono::steady_clock::now() < end) link.handle(50);
  if (heard)
    throw std::runtime_error(
        fmt::format("machine '{}' is already run: process {} answers on {}; stop that one first",
                    config.machine, heard->pid, config.url));
}

}  // namespace trn

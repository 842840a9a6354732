#include "app/gateway/gateway_process.h"

#include <fmt/format.h>
#include <poll.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "app/client/daemon_place.h"
#include "app/client/signing_key.h"
#include "app/gateway/counter_file.h"
#include "app/gateway/gateway.h"
#include "hal/lcm_messages.h"
#include "hal/local_socket.h"
#include "hal/message_codec.h"
#include "hal/udp_group.h"

namespace trn {

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kWaitMs = 100;
constexpr int kDatagramsAtOnce = 128, kPacketsAtOnce = 64;
constexpr auto kConnectAgain = std::chrono::milliseconds(200);

volatile std::sig_atomic_t told_to_end = 0;

void end_on_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { told_to_end = 1; };
  for (const int number : {SIGTERM, SIGINT}) sigaction(number, &action, nullptr);
}

void log_to_stderr() {
  if (!spdlog::get("gateway")) spdlog::set_default_logger(spdlog::stderr_logger_mt("gateway"));
  spdlog::flush_on(spdlog::level::info);
}

std::vector<Gateway::Key> keys_of(const GatewayConfig& config) {
  std::vector<Gateway::Key> keys;
  for (const GatewayConfig::Key& entry : config.keys) {
    const std::optional<PublicKey> key = public_key_of(entry.public_text);
    keys.push_back({entry.name, key ? *key : read_public_key(entry.public_text), entry.role});
    spdlog::info("key '{}' may {}", entry.name, to_string(entry.role));
  }
  if (keys.empty()) spdlog::warn("[gateway] has no key: nothing is let in ('trunnion key make')");
  return keys;
}

std::string counters_path(const GatewayParts& parts) {
  if (!parts.gateway.counters.empty()) return parts.gateway.counters;
  const char* folder = std::getenv("STATE_DIRECTORY");
  if (!folder || folder[0] != '/')
    throw std::runtime_error(
        "[gateway] counters: name a file that outlives this host's restarts, such as "
        "\"/var/lib/trunnion/gateway.counters\"");
  return fmt::format("{}/{}.counters", std::string_view(folder).substr(0, std::string_view(folder).find(':')),
                     parts.names.machine);
}

std::string checked_url(const std::string& url) {
  if (const std::string bad = lcm_self_test(url); !bad.empty()) throw std::runtime_error(bad);
  return url;
}

/// The sockets of the process and what goes through them.
class Process {
 public:
  explicit Process(const GatewayParts& parts)
      : parts_(parts),
        counters_(counters_path(parts), parts.names.machine),
        gateway_(parts.names.machine, keys_of(parts.gateway), parts.gateway.rate_hz_max, counters_,
                 outlets()),
        out_(checked_url(parts.gateway.url)),
        in_(UdpAddress::parse(parts.gateway.url)) {
    if (counters_.is_new()) spdlog::warn("no counters are kept yet: the keys begin anew");
    dispatcher_.subscribe<trunnion::signed_command_t>(
        parts.names.signed_channel(),
        [this](const auto& message) { gateway_.receive(message, sender_, Clock::now()); });
    connect();
  }

  void run() {
    spdlog::info("machine '{}': signed commands are taken at {}", parts_.names.machine, parts_.gateway.url);
    while (!told_to_end) {
      wait();
      take_datagrams();
      gateway_.hand_on();
      take_packets();
      if (!daemon_) connect();
      if (const std::string news = gateway_.refusals().news(Clock::now()); !news.empty())
        spdlog::warn("{}", news);
    }
    spdlog::info("told to end");
  }

 private:
  Gateway::Outlets outlets() {
    return {[this](const auto& command) { return send(parts_.names.command_channel(), command); },
            [this](const auto& readings) { return send(parts_.names.sensor_channel(), readings); },
            [this](const auto& answer) {
              const std::string bad = out_.try_publish(parts_.names.acknowledge_channel(), answer);
              if (!bad.empty()) spdlog::warn("an answer is lost: {}", bad);
            }};
  }

  template <typename Message>
  bool send(const std::string& channel, const Message& message) {
    if (!daemon_) connect();
    return daemon_ && daemon_->publish(channel, message);
  }

  void connect() {
    if (Clock::now() < connect_again_) return;
    connect_again_ = Clock::now() + kConnectAgain;
    Connection made = connect_to_daemon(parts_.access, parts_.names.machine);
    if (!made.link) {
      if (!told_missing_) spdlog::warn("no daemon of this machine yet{}", made.refused);
      told_missing_ = true;
      return;
    }
    daemon_ = std::move(made.link);
    daemon_->subscribe<trunnion::acknowledge_t>(parts_.names.acknowledge_channel(),
                                                [this](const auto& answer) { gateway_.answered(answer); });
    spdlog::info("the daemon is {}", daemon_->server().text());
    told_missing_ = false;
  }

  void wait() const {
    pollfd waited[] = {{in_.fd(), POLLIN, 0}, {daemon_ ? daemon_->fd() : -1, POLLIN, 0}};
    poll(waited, std::size(waited), kWaitMs);
  }

  // A bounded number: what the daemon says has its turn in a flood, too.
  void take_datagrams() {
    std::span<const std::uint8_t> datagram;
    for (int i = 0; i < kDatagramsAtOnce && in_.receive(datagram, sender_); ++i) dispatcher_.accept(datagram);
  }

  // Status and motion come as well and go no further.
  void take_packets() {
    for (int i = 0; daemon_ && i < kPacketsAtOnce; ++i) {
      pollfd waited{daemon_->fd(), POLLIN, 0};
      if (poll(&waited, 1, 0) <= 0) return;
      daemon_->handle(0);
      if (daemon_->closed()) {
        spdlog::warn("the daemon has ended");
        daemon_.reset();
      }
    }
  }

  const GatewayParts& parts_;
  CounterFile counters_;
  Gateway gateway_;
  LcmPublisher out_;
  UdpReceiver in_;
  WireSender sender_;
  MessageDispatcher dispatcher_;
  std::unique_ptr<LocalClient> daemon_;
  Clock::time_point connect_again_;
  bool told_missing_ = false;
};

}  // namespace

void run_gateway(const GatewayParts& parts,
                 const std::function<void(const std::string& counters_folder)>& confine) {
  log_to_stderr();
  end_on_signals();
  Process process(parts);
  confine(std::filesystem::path(counters_path(parts)).parent_path());
  process.run();
}

}  // namespace trn

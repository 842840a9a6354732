#include "app/daemon/command_client.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <system_error>
#include <thread>
#include <utility>

#include "app/daemon/access.h"
#include "app/daemon/command_table.h"
#include "app/daemon/process_lock.h"

namespace trn {

namespace {

using Clock = std::chrono::steady_clock;
constexpr const char* kEnded = "; it has ended the connection (one user may have 24 at a time)";
constexpr auto kConnectAgain = std::chrono::milliseconds(20);
constexpr auto kFirstStatus = std::chrono::milliseconds(500);
constexpr auto kLook = std::chrono::milliseconds(50);
constexpr auto kAskAgain = std::chrono::seconds(1);

Clock::duration seconds(double duration_s) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(duration_s));
}

int milliseconds_until(Clock::time_point moment) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(moment - Clock::now());
  return std::max(0, static_cast<int>(left.count()));
}

std::int64_t random_client() {
  std::random_device device;
  return static_cast<std::int64_t>((std::uint64_t{device()} << 32 | device()) >> 1) | 1;
}

}  // namespace

CommandClient::CommandClient(const Config& config) : config_(config), client_(random_client()) {
  connect();
  listen();
}

// A daemon that is being started may need a moment.
void CommandClient::connect() {
  const auto end = Clock::now() + seconds(config_.timeout_s);
  while (true) {
    const std::string why = try_connect();
    if (link_) return;
    if (!why.empty() || Clock::now() > end) no_answer(why);
    std::this_thread::sleep_for(kConnectAgain);
  }
}

// Returns what will not mend itself.
std::string CommandClient::try_connect() {
  std::string why;
  for (const std::string& path : sockets_to_try(config_.access, config_.lcm.machine)) {
    try {
      auto link = std::make_unique<LocalClient>(path);
      if (is_trusted_user(link->server().uid)) {
        link_ = std::move(link);
        return "";
      }
      why = fmt::format("; {} is a socket of {}, whom nobody here trusts", path, link->server().text());
    } catch (const std::system_error& error) {
      if (error.code() != std::errc::permission_denied) continue;
      why = fmt::format(
          "; this user may not use {}: that needs group '{}' (usermod -aG {} USER, then log in anew)", path,
          config_.access.look, config_.access.look);
    }
  }
  return why;
}

void CommandClient::listen() {
  link_->subscribe<trunnion::acknowledge_t>(config_.lcm.acknowledge_channel(), [this](const auto& answer) {
    if (answer.client == client_ && answer.sequence == sequence_) answer_ = answer;
  });
  link_->subscribe<trunnion::status_t>(config_.lcm.status_channel(), [this](const auto& status) {
    status_ = status;
    daemon_clock_us_ = status.clock_us;
    clock_heard_ = Clock::now();
  });
  link_->subscribe<trunnion::tables_t>(config_.lcm.tables_channel(),
                                       [this](const auto& tables) { tables_ = tables; });
  link_->subscribe<trunnion::motion_t>(config_.lcm.motion_channel(),
                                       [this](const auto& motion) { motion_ = motion; });
}

// One message, or until then.
bool CommandClient::handle(Clock::time_point until) {
  const bool heard = link_->handle(milliseconds_until(until));
  if (!heard && link_->closed()) no_answer(kEnded);
  return heard;
}

trunnion::acknowledge_t CommandClient::send(trunnion::command_t command) {
  using trunnion::acknowledge_t;
  command.client = client_;
  command.sequence = ++sequence_;
  command.expires_us = makes_safe(command) ? 0 : expiry_us();
  answer_.reset();
  auto last_heard = Clock::now();
  const auto working = [&] { return answer_ && answer_->outcome == acknowledge_t::WORKING; };
  while (!answer_ || working()) {
    const auto patience =
        seconds(config_.timeout_s) + (working() ? Clock::duration(kAskAgain) : Clock::duration(0));
    if (Clock::now() - last_heard > patience) no_answer("");
    if (!link_->publish(config_.lcm.command_channel(), command)) no_answer(kEnded);
    const auto ask_again = Clock::now() + std::min<Clock::duration>(kAskAgain, seconds(config_.timeout_s));
    while (Clock::now() < ask_again && (!answer_ || working())) {
      const std::optional<acknowledge_t> before = std::exchange(answer_, std::nullopt);
      handle(ask_again);
      if (answer_) last_heard = Clock::now();
      if (!answer_) answer_ = before;
    }
  }
  return *answer_;
}

trunnion::tables_t CommandClient::tables() {
  for (const auto end = Clock::now() + seconds(config_.timeout_s); !tables_;) {
    if (Clock::now() > end) no_answer("");
    handle(std::min<Clock::time_point>(end, Clock::now() + kLook));
  }
  return *tables_;
}

void CommandClient::send_sensor(const trunnion::sensor_t& readings) {
  if (!link_->publish(config_.lcm.sensor_channel(), readings)) no_answer(kEnded);
  while (link_->handle(0)) {  // what is not read is lost, but fills the socket
  }
}

// Two clocks need not agree, not even on one host: the daemon's is read from its status messages.
std::int64_t CommandClient::expiry_us() {
  const auto asked = Clock::now();
  const auto end = asked + std::max<Clock::duration>(seconds(config_.timeout_s), kFirstStatus);
  while (daemon_clock_us_ == 0) {
    handle(end);
    if (daemon_clock_us_ == 0 && Clock::now() > end) no_answer("");
  }
  const auto since = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - clock_heard_);
  return daemon_clock_us_ + since.count() + static_cast<std::int64_t>(config_.timeout_s * 1e6);
}

std::optional<trunnion::status_t> CommandClient::wait_status(
    const std::function<bool(const trunnion::status_t&)>& wanted, double patience_s) {
  const auto end = Clock::now() + seconds(patience_s);
  auto last_heard = Clock::now();
  while (Clock::now() < end) {
    status_.reset();
    handle(Clock::now() + kLook);
    if (status_) {
      last_heard = Clock::now();
      if (wanted(*status_)) return status_;
    }
    if (Clock::now() - last_heard > seconds(config_.timeout_s)) no_answer("");
  }
  return std::nullopt;
}

void CommandClient::watch(
    const std::function<bool(const trunnion::status_t&, const trunnion::motion_t&)>& show) {
  auto last_heard = Clock::now();
  while (true) {
    motion_.reset();
    handle(Clock::now() + kLook);
    if (motion_ && status_) {
      last_heard = Clock::now();
      if (!show(*status_, *motion_)) return;
    }
    if (Clock::now() - last_heard > seconds(config_.timeout_s)) no_answer("");
  }
}

void CommandClient::no_answer(const std::string& why) const {
  throw NoAnswer(
      fmt::format("no daemon answers for machine '{}' within {} s{}; start one with 'trunnion daemon "
                  "--machine CONFIG'",
                  config_.lcm.machine, config_.timeout_s, why));
}

}  // namespace trn

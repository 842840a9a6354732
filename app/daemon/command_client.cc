#include "app/daemon/command_client.h"

#include <fmt/format.h>

#include <chrono>
#include <random>

#include "app/daemon/command_server.h"

namespace trn {

namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kRepeat = std::chrono::milliseconds(100);
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

CommandClient::CommandClient(const Config& config)
    : config_(config), client_(random_client()), link_(config.lcm.url) {
  link_.subscribe<trunnion::acknowledge_t>(config.lcm.acknowledge_channel(), [this](const auto& answer) {
    if (answer.client != client_ || answer.sequence != sequence_) return;
    answer_ = answer;
    daemon_ = link_.sender();
  });
  link_.subscribe<trunnion::status_t>(config.lcm.status_channel(), [this](const auto& status) {
    if (daemon_ && *daemon_ != link_.sender()) return;
    status_ = status;
    daemon_clock_us_ = status.clock_us;
    clock_heard_ = Clock::now();
  });
  link_.subscribe<trunnion::motion_t>(config.lcm.motion_channel(),
                                      [this](const auto& motion) { motion_ = motion; });
}

trunnion::acknowledge_t CommandClient::send(trunnion::command_t command) {
  using trunnion::acknowledge_t;
  command.client = client_;
  command.sequence = ++sequence_;
  command.expires_us = makes_safe(command) ? 0 : expiry_us();
  answer_.reset();
  const auto asked = Clock::now();
  auto last_heard = asked;
  const auto working = [&] { return answer_ && answer_->outcome == acknowledge_t::WORKING; };
  while (!answer_ || working()) {
    link_.publish(config_.lcm.command_channel(), command);
    const bool was_working = working();
    const auto ask_again =
        Clock::now() + (was_working ? Clock::duration(kAskAgain) : Clock::duration(kRepeat));
    while (Clock::now() < ask_again && (!answer_ || working())) {
      if (!link_.handle(milliseconds_until(ask_again))) continue;
      if (answer_) last_heard = Clock::now();
    }
    if (!answer_ && Clock::now() - asked > seconds(config_.timeout_s)) no_answer();
    if (working() && Clock::now() - last_heard > seconds(config_.timeout_s) + kAskAgain) no_answer();
  }
  return *answer_;
}

// Two clocks need not agree, not even on one host: the daemon's is read from its status messages.
std::int64_t CommandClient::expiry_us() {
  const auto asked = Clock::now();
  const auto patience = std::max(seconds(config_.timeout_s), 5 * Clock::duration(kRepeat));
  while (daemon_clock_us_ == 0) {
    link_.handle(50);
    if (daemon_clock_us_ == 0 && Clock::now() - asked > patience) no_answer();
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
    link_.handle(50);
    if (status_) {
      last_heard = Clock::now();
      if (wanted(*status_)) return status_;
    }
    if (Clock::now() - last_heard > seconds(config_.timeout_s)) no_answer();
  }
  return std::nullopt;
}

void CommandClient::watch_motion(const std::function<bool(const trunnion::motion_t&)>& show) {
  auto last_heard = Clock::now();
  while (true) {
    motion_.reset();
    link_.handle(50);
    if (motion_) {
      last_heard = Clock::now();
      if (!show(*motion_)) return;
    }
    if (Clock::now() - last_heard > seconds(config_.timeout_s)) no_answer();
  }
}

void CommandClient::no_answer() const {
  throw NoAnswer(
      fmt::format("no daemon answers for machine '{}' on {} within {} s; start one with 'trunnion daemon "
                  "--machine CONFIG'",
                  config_.lcm.machine, config_.lcm.url, config_.timeout_s));
}

}  // namespace trn

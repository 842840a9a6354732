#include "app/client/command_client.h"

#include <algorithm>
#include <chrono>
#include <random>
#include <utility>

#include "app/client/command_table.h"

namespace trn {

namespace {

using Clock = std::chrono::steady_clock;
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

CommandClient::CommandClient(const Config& config)
    : CommandClient(std::make_unique<SocketLine>(config.lcm, config.access, config.timeout_s),
                    config.timeout_s) {}

CommandClient::CommandClient(std::unique_ptr<DaemonLine> line, double timeout_s)
    : line_(std::move(line)), timeout_s_(timeout_s), client_(random_client()) {
  listen();
}

void CommandClient::listen() {
  DaemonListener listener;
  listener.acknowledge = [this](const auto& answer) {
    if (answer.client == client_ && answer.sequence == sequence_) answer_ = answer;
  };
  listener.status = [this](const auto& status) {
    status_ = known_ = status;
    daemon_clock_us_ = status.clock_us;
    clock_heard_ = Clock::now();
  };
  listener.motion = [this](const auto& motion) { motion_ = motion; };
  listener.tables = [this](const auto& tables) { tables_ = tables; };
  listener.alarms = [this](const auto& alarms) { alarms_ = alarms; };
  line_->listen(listener);
}

// One message, or until then.
bool CommandClient::handle(Clock::time_point until) {
  const bool heard = line_->handle(milliseconds_until(until));
  if (const std::string why = heard ? "" : line_->ended(); !why.empty()) no_answer(why);
  return heard;
}

trunnion::acknowledge_t CommandClient::send(trunnion::command_t command) {
  using trunnion::acknowledge_t;
  command.client = client_;
  command.sequence = ++sequence_;
  command.expires_us = makes_safe(command) ? 0 : expiry_us(command);
  answer_.reset();
  auto last_heard = Clock::now(), looked = last_heard;
  longest_look_ = {};
  const auto working = [&] { return answer_ && answer_->outcome == acknowledge_t::WORKING; };
  while (!answer_ || working()) {
    const auto patience = seconds(timeout_s_) + (working() ? Clock::duration(kAskAgain) : Clock::duration(0));
    if (Clock::now() - last_heard > patience) no_answer("");
    if (const std::string why = line_->send(command); !why.empty()) no_answer(why);
    const Clock::duration pause = working() ? Clock::duration(kAskAgain) : line_->ask_again();
    const auto ask_again = Clock::now() + std::min(pause, seconds(timeout_s_));
    while (Clock::now() < ask_again && (!answer_ || working())) {
      const std::optional<acknowledge_t> before = std::exchange(answer_, std::nullopt);
      handle(std::min<Clock::time_point>(ask_again, Clock::now() + kLook));
      longest_look_ = std::max(longest_look_, Clock::now() - std::exchange(looked, Clock::now()));
      if (answer_) last_heard = looked;
      if (!answer_) answer_ = before;
    }
  }
  return *answer_;
}

template <typename Message>
Message CommandClient::await(const std::optional<Message>& heard) {
  for (const auto end = Clock::now() + seconds(timeout_s_); !heard;) {
    if (Clock::now() > end) no_answer("");
    handle(std::min<Clock::time_point>(end, Clock::now() + kLook));
  }
  return *heard;
}

trunnion::tables_t CommandClient::tables() { return await(tables_); }

trunnion::alarms_t CommandClient::alarms() { return await(alarms_); }

void CommandClient::send_sensor(const trunnion::sensor_t& readings) {
  if (const std::string why = line_->send(readings); !why.empty()) no_answer(why);
  while (line_->handle(0)) {  // what is not read is lost, but fills the socket
  }
}

// Two clocks need not agree, not even on one host: the daemon's is read from its status messages.
std::int64_t CommandClient::expiry_us(const trunnion::command_t& command) {
  const auto asked = Clock::now();
  const auto end = asked + std::max<Clock::duration>(seconds(timeout_s_), kFirstStatus);
  while (daemon_clock_us_ == 0) {
    handle(end);
    if (daemon_clock_us_ == 0 && Clock::now() > end) no_answer("");
  }
  const auto since = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - clock_heard_);
  // A jog that somebody holds is not begun by what was said while he still held it.
  const double valid_s =
      command.alive_ms > 0 ? 1e-3 * command.alive_ms : std::min(timeout_s_, kCommandLifeMax_s);
  return daemon_clock_us_ + since.count() + static_cast<std::int64_t>(valid_s * 1e6);
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
    if (Clock::now() - last_heard > seconds(timeout_s_)) no_answer("");
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
    if (Clock::now() - last_heard > seconds(timeout_s_)) no_answer("");
  }
}

void CommandClient::no_answer(const std::string& why) const {
  throw NoAnswer(line_->silence(timeout_s_, why));
}

}  // namespace trn

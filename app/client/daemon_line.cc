#include "app/client/daemon_line.h"

#include <fmt/format.h>

#include <thread>
#include <utility>

#include "app/client/command_table.h"
#include "app/client/daemon_place.h"

namespace trn {

namespace {

using Clock = std::chrono::steady_clock;
constexpr const char* kEnded = kConnectionEnded;
constexpr auto kConnectAgain = std::chrono::milliseconds(20);

}  // namespace

// A daemon that is being started may need a moment.
SocketLine::SocketLine(const LcmConfig& names, const AccessConfig& access, double timeout_s)
    : names_(names), access_(access) {
  const auto end = Clock::now() + std::chrono::duration<double>(timeout_s);
  while (true) {
    const std::string why = try_connect();
    if (link_) return;
    if (!why.empty() || Clock::now() > end) throw NoAnswer(silence(timeout_s, why));
    std::this_thread::sleep_for(kConnectAgain);
  }
}

// Returns what will not mend itself.
std::string SocketLine::try_connect() {
  Connection made = connect_to_daemon(access_, names_.machine);
  link_ = std::move(made.link);
  return made.refused;
}

std::string SocketLine::send(const trunnion::command_t& command) {
  safe_ = makes_safe(command) ? std::optional(command) : std::nullopt;
  return link_->publish(names_.command_channel(), command) || go_over() ? "" : kEnded;
}

bool SocketLine::handle(int timeout_ms) {
  const bool heard = link_->handle(timeout_ms);
  if (link_->closed()) go_over();
  return heard;
}

// Where the daemon has no room for this client, what makes the machine safer is sent once more, to the socket
// that is kept for that.
bool SocketLine::go_over() {
  if (went_over_ || !safe_) return false;
  went_over_ = true;
  Connection made = connect_to_daemon(access_, names_.machine, true);
  if (!made.link) return false;
  link_ = std::move(made.link);
  subscribe();
  return link_->publish(names_.command_channel(), *safe_);
}

void SocketLine::listen(const DaemonListener& listener) {
  listener_ = listener;
  subscribe();
}

void SocketLine::subscribe() {
  listener_.subscribe(*link_, names_);
  if (listener_.scope_signals)
    link_->subscribe<trunnion::scope_signals_t>(names_.scope_signals_channel(), listener_.scope_signals);
  if (listener_.scope_data)
    link_->subscribe<trunnion::scope_data_t>(names_.scope_data_channel(), listener_.scope_data);
}

std::string SocketLine::send(const trunnion::scope_request_t& request) {
  return link_->publish(names_.scope_request_channel(), request) ? "" : kEnded;
}

std::string SocketLine::send(const trunnion::sensor_t& readings) {
  return link_->publish(names_.sensor_channel(), readings) ? "" : kEnded;
}

std::string SocketLine::ended() const { return link_->closed() ? kEnded : ""; }

std::string SocketLine::silence(double timeout_s, const std::string& why) const {
  if (why == kEnded) return fmt::format("the daemon of machine '{}' {}", names_.machine, why);
  return fmt::format(
      "no daemon answers for machine '{}' within {} s{}; start one with 'trunnion daemon "
      "--machine CONFIG'",
      names_.machine, timeout_s, why);
}

}  // namespace trn

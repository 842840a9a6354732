#include "app/client/scope_client.h"

#include <fmt/format.h>

#include <chrono>
#include <limits>
#include <random>
#include <stdexcept>
#include <thread>
#include <utility>

#include "app/client/daemon_line.h"
#include "app/client/daemon_place.h"

namespace trn {

namespace {

using ScopeClock = std::chrono::steady_clock;
constexpr auto kLookAgain = std::chrono::milliseconds(20);
constexpr auto kAskScopeAgain = std::chrono::milliseconds(500);  // the daemon may have turned one away
constexpr int kWaitMs = 20;

std::int64_t random_number() {
  std::random_device device;
  return static_cast<std::int64_t>(std::uint64_t{device()} << 31 ^ device());
}

}  // namespace

ScopeClient::ScopeClient(const LcmConfig& names, const AccessConfig& access, double timeout_s)
    : names_(names), timeout_s_(timeout_s), client_(random_number()) {
  const auto end = ScopeClock::now() + std::chrono::duration<double>(timeout_s);
  while (!link_) {
    Connection made = connect_to_daemon(access, names.machine);
    link_ = std::move(made.link);
    if (!link_ && (!made.refused.empty() || ScopeClock::now() > end))
      throw NoAnswer(
          fmt::format("no daemon answers for machine '{}' within {:g} s{}; start one with 'trunnion "
                      "daemon --machine CONFIG'",
                      names.machine, timeout_s, made.refused));
    if (!link_) std::this_thread::sleep_for(kLookAgain);
  }
  link_->subscribe<trunnion::scope_signals_t>(names.scope_signals_channel(),
                                              [this](const auto& list) { list_ = list; });
  link_->subscribe<trunnion::scope_data_t>(names.scope_data_channel(),
                                           [this](const auto& data) { data_ = data; });
}

template <typename Message>
Message ScopeClient::ask(trunnion::scope_request_t request, std::optional<Message>& answer) {
  request.client = client_;
  request.sequence = ++sequence_;
  const auto end = ScopeClock::now() + std::chrono::duration<double>(timeout_s_);
  auto again = ScopeClock::now();
  while (ScopeClock::now() < end && !link_->closed()) {
    if (ScopeClock::now() >= again) {
      link_->publish(names_.scope_request_channel(), request);
      again = ScopeClock::now() + kAskScopeAgain;
    }
    answer.reset();
    link_->handle(kWaitMs);
    if (answer && answer->client == client_ && answer->sequence == sequence_) return *answer;
  }
  throw NoAnswer(
      fmt::format("the daemon of machine '{}' does not answer a scope within {:g} s; is it of this "
                  "version, and may you look ([access])?",
                  names_.machine, timeout_s_));
}

trunnion::scope_signals_t ScopeClient::signals() { return ask<trunnion::scope_signals_t>({}, list_); }

trunnion::scope_data_t ScopeClient::rows(const std::vector<std::string>& signals, std::int64_t from_period) {
  trunnion::scope_request_t request{};
  request.from_period = from_period;
  request.rows_max = std::numeric_limits<std::int32_t>::max();
  request.signal_count = static_cast<std::int32_t>(signals.size());
  request.signal = signals;
  trunnion::scope_data_t data = ask<trunnion::scope_data_t>(std::move(request), data_);
  if (!data.message.empty()) throw std::runtime_error(data.message);
  return data;
}

}  // namespace trn

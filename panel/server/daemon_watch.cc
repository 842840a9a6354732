#include "panel/server/daemon_watch.h"

#include <random>
#include <utility>
#include <vector>

#include "app/client/command_table.h"

namespace trn {

namespace {

using trunnion::acknowledge_t;
using namespace std::chrono_literals;

constexpr auto kSilence = 1s, kConnectAgain = 1s, kUnanswered = 5s, kExpiry = 2s;
constexpr int kMessagesAtOnce = 200;
constexpr std::size_t kAskedMax = 64;

std::int64_t random_client() {
  std::random_device device;
  return static_cast<std::int64_t>((std::uint64_t{device()} << 32 | device()) >> 1) | 1;
}

std::string outcome_of(const acknowledge_t& answer) {
  switch (answer.outcome) {
    case acknowledge_t::ACCEPTED:
      return "accepted";
    case acknowledge_t::BAD_PROGRAM:
      return "bad_program";
    case acknowledge_t::FAULT:
      return "fault";
    default:
      return "refused";
  }
}

acknowledge_t no_answer(const std::string& why) {
  acknowledge_t answer{};
  answer.message = why;
  return answer;
}

}  // namespace

DaemonWatch::DaemonWatch(std::function<std::unique_ptr<DaemonLine>()> make_line)
    : make_line_(std::move(make_line)), tried_(Clock::now() - kConnectAgain), client_(random_client()) {}

void DaemonWatch::step() {
  if (!line_ && Clock::now() - tried_ >= kConnectAgain) connect();
  for (int i = 0; line_ && i < kMessagesAtOnce && line_->handle(0); ++i) {
  }
  if (line_ && !line_->ended().empty()) {
    line_.reset();
    give_up("the daemon has ended the connection");
  }
  ask_again();
}

void DaemonWatch::connect() {
  tried_ = Clock::now();
  try {
    line_ = make_line_();
  } catch (const NoAnswer&) {
    return;  // the next try is a second away, and pages are told that the daemon is silent
  }
  DaemonListener listener;
  listener.acknowledge = [this](const acknowledge_t& heard) { answer(heard); };
  listener.status = [this](const trunnion::status_t& status) {
    status_ = status;
    status_heard_ = Clock::now();
    if (on_status) on_status();
  };
  listener.motion = [this](const trunnion::motion_t& motion) {
    motion_ = motion;
    if (on_motion) on_motion();
  };
  listener.tables = [this](const trunnion::tables_t& tables) {
    tables_ = tables;
    if (on_tables) on_tables();
  };
  listener.alarms = [this](const trunnion::alarms_t& alarms) {
    alarms_ = alarms;
    if (on_alarms) on_alarms();
  };
  listener.scope_signals = [this](const auto& list) {
    if (list.client == client_) on_scope_signals(list);
  };
  listener.scope_data = [this](const auto& data) {
    if (data.client == client_) on_scope_data(data);
  };
  line_->listen(listener);
}

bool DaemonWatch::connected() const { return line_ && status_ && Clock::now() - status_heard_ < kSilence; }

double DaemonWatch::age_s() const {
  return status_ ? std::chrono::duration<double>(Clock::now() - status_heard_).count() : -1;
}

void DaemonWatch::send(trunnion::command_t command, Answer done) {
  command.client = client_;
  command.sequence = ++sequence_;
  const bool safe = makes_safe(command);
  if (!line_ || (!safe && (!connected() || asked_.size() >= kAskedMax))) {
    done("unreachable", no_answer("no daemon answers for this machine"));
    return;
  }
  // On the daemon's own clock, so that nothing that may move the machine acts long after it was asked for.
  const auto since = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - status_heard_);
  const std::chrono::microseconds late = since + kExpiry;
  command.expires_us = safe ? 0 : status_->clock_us + late.count();
  const auto now = Clock::now();
  const std::string why = line_->send(command);
  if (why.empty())
    asked_[command.sequence] = {command, std::move(done), now, now};
  else
    done("unreachable", no_answer("the command could not be sent"));
}

std::int32_t DaemonWatch::send(trunnion::scope_request_t request) {
  request.client = client_;
  request.sequence = ++scope_sequence_;
  auto* const own = dynamic_cast<SocketLine*>(line_.get());  // the scope is asked on the daemon's own host
  return own && own->send(request).empty() ? request.sequence : 0;
}

void DaemonWatch::answer(const acknowledge_t& heard) {
  const auto found = heard.client == client_ ? asked_.find(heard.sequence) : asked_.end();
  if (found == asked_.end()) return;
  found->second.heard = Clock::now();
  if (heard.outcome == acknowledge_t::WORKING) return;
  const Answer done = std::move(found->second.done);
  asked_.erase(found);
  done(outcome_of(heard), heard);
}

// An answer may be lost, and the daemon acts once on a command however often it hears it. A jog is said once
// all the same: it would move the machine a second time if that ever failed.
void DaemonWatch::ask_again() {
  std::vector<std::int32_t> lost;
  for (auto& [sequence, asked] : asked_) {
    if (Clock::now() - asked.heard > kUnanswered) lost.push_back(sequence);
    const bool again = asked.command.verb != trunnion::command_t::JOG;
    if (!line_ || !again || Clock::now() - asked.sent < line_->ask_again()) continue;
    asked.sent = Clock::now();
    line_->send(asked.command);
  }
  for (const std::int32_t sequence : lost) {
    const Answer done = std::move(asked_[sequence].done);
    asked_.erase(sequence);
    done("unreachable", no_answer("the daemon did not answer"));
  }
}

void DaemonWatch::give_up(const std::string& why) {
  for (auto& [sequence, asked] : std::exchange(asked_, {})) asked.done("unreachable", no_answer(why));
}

}  // namespace trn

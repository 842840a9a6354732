#include "app/daemon/command_server.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>

#include "app/daemon/telemetry.h"
#include "core/check.h"
#include "hal/socket_owner.h"
#include "hal/udp_group.h"

namespace trn {

namespace {

using trunnion::acknowledge_t;
using Clock = CommandGate::Clock;

constexpr std::size_t kMessageBytesMax = 4000;  // a message of an error is text for people

std::string name_of(const WireSender& sender) {
  const auto owner = owner_of_port(sender.port);
  return owner ? fmt::format("user {} (port {})", *owner, sender.port) : fmt::format("port {}", sender.port);
}

}  // namespace

CommandServer::CommandServer(LcmLink& link, const LcmConfig& config, Obey obey, StatusCount status_count,
                             Ready ready)
    : link_(link),
      channel_(config.acknowledge_channel()),
      obey_(std::move(obey)),
      status_count_(std::move(status_count)),
      ready_(std::move(ready)) {
  link_.subscribe<trunnion::command_t>(config.command_channel(),
                                       [this](const trunnion::command_t& command) { receive(command); });
}

void CommandServer::receive(const trunnion::command_t& command) {
  const Ticket ticket{command.client, command.sequence};
  const bool admitted = gate_.admit(link_.sender(), Clock::now());
  if (const acknowledge_t* answered = replies_.find(command)) {
    if (admitted) send(*answered);
    return;
  }
  if (makes_safe(command)) {
    give_up_waiting();
    return obey(command);
  }
  if (!admitted) return turn_away(ticket, refusals_.admit(link_.sender(), Clock::now()));
  if (waiting_.empty() && ready_()) return obey(command);
  const bool waits = std::any_of(waiting_.begin(), waiting_.end(), [&](const auto& other) {
    return other.client == command.client && other.sequence == command.sequence;
  });
  if (waits) return;
  if (waiting_.size() >= kWaitingMax) return turn_away(ticket, true);
  waiting_.push_back(command);
  TRN_CHECK(waiting_.size() <= kWaitingMax);
}

void CommandServer::poll() {
  while (!waiting_.empty() && ready_()) {
    const trunnion::command_t command = std::move(waiting_.front());
    waiting_.pop_front();
    obey(command);
  }
}

void CommandServer::obey(const trunnion::command_t& command) {
  const Ticket ticket{command.client, command.sequence};
  const bool expires = command.expires_us != 0 && !makes_safe(command);  // no clock stands before a stop
  const bool expired = expires && monotonic_us() > command.expires_us;
  if (expired)
    return reply(ticket,
                 {acknowledge_t::REFUSED, "the command arrived too late and was not obeyed; send it again"});
  try {
    reply(ticket, obey_(command, ticket));
  } catch (const std::exception& error) {
    reply(ticket, {acknowledge_t::REFUSED, fmt::format("the command failed: {}", error.what())});
  }
}

// What was sent before a stop must not move the machine behind it.
void CommandServer::give_up_waiting() {
  for (const trunnion::command_t& command : waiting_)
    reply({command.client, command.sequence},
          {acknowledge_t::REFUSED, "not obeyed: a stop or hold came while it waited; send it again"});
  waiting_.clear();
}

// Not entered in the cache, which would forget what others sent: a copy is judged anew.
void CommandServer::turn_away(const Ticket& ticket, bool may_answer) {
  if (gate_.must_tell(Clock::now()))
    spdlog::warn("{} sends more commands than are heard ({:g} a second): the rest is refused",
                 name_of(link_.sender()), CommandGate::kSenderRate);
  if (may_answer)
    send(message_of(ticket, {acknowledge_t::REFUSED,
                             fmt::format("too many commands: {:g} a second are heard; send it again later",
                                         CommandGate::kSenderRate)}));
}

void CommandServer::finish(const Ticket& ticket, const Answer& answer) { reply(ticket, answer); }

void CommandServer::reply(const Ticket& ticket, const Answer& answer) {
  const acknowledge_t message = message_of(ticket, answer);
  replies_.enter(message);
  send(message);
}

acknowledge_t CommandServer::message_of(const Ticket& ticket, const Answer& answer) const {
  acknowledge_t message{};
  message.client = ticket.client;
  message.sequence = ticket.sequence;
  message.outcome = answer.outcome;
  message.status_count = status_count_();
  message.message = answer.message.substr(0, kMessageBytesMax);
  return message;
}

// A machine that nobody hears goes on; the client asks again.
void CommandServer::send(const acknowledge_t& message) {
  const std::string bad = link_.try_publish(channel_, message);
  if (!bad.empty() && !send_failed_) spdlog::error("no answer reaches the clients: {}", bad);
  send_failed_ = !bad.empty();
}

}  // namespace trn

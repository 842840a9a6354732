#include "app/daemon/command_server.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>

#include "app/client/command_rights.h"
#include "app/client/command_table.h"
#include "app/daemon/telemetry.h"
#include "core/check.h"
#include "core/utf8.h"

namespace trn {

namespace {

using trunnion::acknowledge_t;
using Clock = CommandGate::Clock;

constexpr double kClocksApart_s = 1;  // a client counts on by a clock of its own

bool lives_too_long(const trunnion::command_t& command) {
  constexpr auto kMax_us = static_cast<std::int64_t>(1e6 * (kCommandLifeMax_s + kClocksApart_s));
  return command.expires_us > daemon_clock_us() + kMax_us;
}

}  // namespace

CommandServer::CommandServer(LocalServer& socket, const AccessRules& access, const LcmConfig& config,
                             Obey obey, StatusCount status_count, Ready ready)
    : socket_(socket),
      access_(access),
      channel_(config.acknowledge_channel()),
      obey_(std::move(obey)),
      status_count_(std::move(status_count)),
      ready_(std::move(ready)) {
  socket_.subscribe<trunnion::command_t>(config.command_channel(),
                                         [this](const trunnion::command_t& command) { receive(command); });
}

void CommandServer::receive(const trunnion::command_t& command) {
  if (const Peer* peer = socket_.peer(socket_.sender())) receive_from(*peer, command);
}

void CommandServer::receive_from(const Peer& peer, const trunnion::command_t& command) {
  const Ticket ticket{command.client, command.sequence, socket_.sender(), peer.uid, peer.text()};
  const CommandGate::Sender process{peer.uid, peer.pid};
  const bool admitted = gate_.admit(process, Clock::now());
  if (const acknowledge_t* answered = replies_.find(peer.uid, command)) {
    if (admitted) send(ticket, *answered);
    return;
  }
  if (makes_safe(command)) {
    give_up_waiting();
    return obey(command, ticket);
  }
  if (!admitted) return turn_away(ticket, refusals_.admit(process, Clock::now()));
  if (!may(peer, command, ticket)) return;
  if (lives_too_long(command))
    return reply(ticket,
                 {acknowledge_t::REFUSED,
                  fmt::format("the command would expire in more than {:g} s, the most that is legal "
                              "('expires_us' by the daemon's clock); ask for the status, then send it again",
                              kCommandLifeMax_s)});
  if (waiting_.empty() && ready_()) return obey(command, ticket);
  wait(command, ticket, process);
}

// Not entered in the cache: it may be given the role, and ask again.
bool CommandServer::may(const Peer& peer, const trunnion::command_t& command, const Ticket& ticket) {
  const Role role = role_for(command);
  if (access_.allows(peer, role)) return true;
  const CommandRow* row = find_command(command.verb);
  spdlog::warn("{} is refused '{}': no right to {}", ticket.from, row ? row->name : "?", to_string(role));
  send(ticket, message_of(ticket, {acknowledge_t::REFUSED, access_.refusal(peer, role)}));
  return false;
}

// One process that sends much keeps no other's command from waiting.
void CommandServer::wait(const trunnion::command_t& command, const Ticket& ticket,
                         const CommandGate::Sender& process) {
  const bool waits = std::any_of(waiting_.begin(), waiting_.end(), [&](const Waiting& other) {
    return other.ticket.user == ticket.user && other.ticket.client == ticket.client &&
           other.ticket.sequence == ticket.sequence;
  });
  if (waits) return;
  const auto own = static_cast<std::size_t>(std::count_if(
      waiting_.begin(), waiting_.end(), [&](const Waiting& other) { return other.process == process; }));
  if (own >= kWaitingOfOne || waiting_.size() >= kWaitingMax)  // not entered in the cache, as in turn_away
    return send(ticket, message_of(ticket, {acknowledge_t::REFUSED,
                                            fmt::format("the machine is busy, and {} commands of this client "
                                                        "wait already; send it again later",
                                                        own)}));
  waiting_.push_back({command, ticket, process});
  TRN_CHECK(waiting_.size() <= kWaitingMax);
}

void CommandServer::poll() {
  while (!waiting_.empty() && ready_()) {
    const Waiting next = std::move(waiting_.front());
    waiting_.pop_front();
    obey(next.command, next.ticket);
  }
}

void CommandServer::obey(const trunnion::command_t& command, const Ticket& ticket) {
  const bool expires = command.expires_us != 0 && !makes_safe(command);  // no clock stands before a stop
  const bool expired = expires && daemon_clock_us() > command.expires_us;
  if (expired)
    return reply(ticket,
                 {acknowledge_t::REFUSED, "the command arrived too late and was not obeyed; send it again"});
  try {
    reply(ticket, obey_(command, ticket));
  } catch (const std::exception& error) {
    reply(ticket, {acknowledge_t::REFUSED, fmt::format("the command failed: {}", error.what())});
  }
}

void CommandServer::give_up_waiting() {
  for (const Waiting& waiting : waiting_)
    reply(waiting.ticket,
          {acknowledge_t::REFUSED, "not obeyed: a stop or hold came while it waited; send it again"});
  waiting_.clear();
}

// Not entered in the cache, which would forget what others sent: a copy is judged anew.
void CommandServer::turn_away(const Ticket& ticket, bool may_answer) {
  if (gate_.must_tell(Clock::now()))
    spdlog::warn("{} sends more commands than are heard ({:g} a second): the rest is refused", ticket.from,
                 CommandGate::kSenderRate);
  if (may_answer)
    send(ticket,
         message_of(ticket, {acknowledge_t::REFUSED,
                             fmt::format("too many commands: {:g} a second are heard; send it again later",
                                         CommandGate::kSenderRate)}));
}

void CommandServer::finish(const Ticket& ticket, const Answer& answer) { reply(ticket, answer); }

void CommandServer::reply(const Ticket& ticket, const Answer& answer) {
  const acknowledge_t message = message_of(ticket, answer);
  replies_.enter(ticket.user, message);
  send(ticket, message);
}

acknowledge_t CommandServer::message_of(const Ticket& ticket, const Answer& answer) const {
  acknowledge_t message{};
  message.client = ticket.client;
  message.sequence = ticket.sequence;
  message.outcome = answer.outcome;
  message.status_count = status_count_();
  message.message = first_letters(answer.message, kMessageBytesMax);
  return message;
}

// A machine that nobody hears goes on; the client asks again.
void CommandServer::send(const Ticket& ticket, const acknowledge_t& message) {
  socket_.send(ticket.connection, channel_, message);
}

}  // namespace trn

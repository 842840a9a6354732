#include "kernel/daemon/command_desk.h"

#include <chrono>

namespace trn {

namespace {

std::int64_t unix_us() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}

}  // namespace

CommandDesk::CommandDesk(LcmLink& link, const LcmConfig& config, Obey obey, StatusCount status_count)
    : link_(link),
      channel_(config.acknowledge_channel()),
      obey_(std::move(obey)),
      status_count_(std::move(status_count)) {
  link_.subscribe<trunnion::command_t>(config.command_channel(),
                                       [this](const trunnion::command_t& command) { receive(command); });
}

void CommandDesk::receive(const trunnion::command_t& command) {
  const Ticket ticket{command.client, command.sequence};
  if (const trunnion::acknowledge_t* answered = book_.find(command)) {
    link_.publish(channel_, *answered);
    return;
  }
  const bool expired = command.expires_us != 0 && unix_us() > command.expires_us;
  if (expired)
    reply(ticket, {trunnion::acknowledge_t::REFUSED,
                   "the command arrived too late and was not obeyed; send it again"});
  else
    reply(ticket, obey_(command, ticket));
}

void CommandDesk::finish(const Ticket& ticket, const Answer& answer) { reply(ticket, answer); }

void CommandDesk::reply(const Ticket& ticket, const Answer& answer) {
  trunnion::acknowledge_t message{};
  message.client = ticket.client;
  message.sequence = ticket.sequence;
  message.outcome = answer.outcome;
  message.status_count = status_count_();
  message.message = answer.message;
  book_.enter(message);
  link_.publish(channel_, message);
}

}  // namespace trn

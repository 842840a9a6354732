#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>

#include "app/daemon/access.h"
#include "app/daemon/command_gate.h"
#include "app/daemon/reply_cache.h"
#include "hal/lcm_link.h"
#include "hal/local_socket.h"

namespace trn {

/// The daemon's side of the command socket: obeys each command once, if its sender may give it, answers every
/// copy, refuses what has expired by the daemon's own clock, and what is too much. A command is acknowledged
/// as obeyed only when it was; what makes the machine safe is obeyed at once, whoever sends it, and ends the
/// waiting of all others. Lives in the thread that handles the socket.
class CommandServer {
 public:
  static constexpr std::size_t kMessageBytesMax = 4000;  ///< of an answer: text for people
  struct Answer {
    std::int8_t outcome = trunnion::acknowledge_t::ACCEPTED;  ///< as in acknowledge_t
    std::string message;
  };
  /// Which command an answer belongs to, and where it goes.
  struct Ticket {
    std::int64_t client = 0;
    std::int32_t sequence = 0;
    ConnectionId connection = 0;
    uid_t user = 0;
    std::string from;  ///< who sent it, for people
  };
  /// Obeys a command, or leaves it at WORKING and calls `finish` later.
  using Obey = std::function<Answer(const trunnion::command_t&, const Ticket&)>;
  /// Count of the next status message.
  using StatusCount = std::function<std::int64_t()>;
  /// True while the machine can take a command; else commands wait for `poll`.
  using Ready = std::function<bool()>;

  CommandServer(
      LocalServer& socket, const AccessRules& access, const LcmConfig& config, Obey obey,
      StatusCount status_count, Ready ready = [] { return true; });

  /// The final answer to a command that was left at WORKING.
  void finish(const Ticket& ticket, const Answer& answer);
  /// Whether who sent that command is still connected.
  bool reaches(const Ticket& ticket) const { return socket_.peer(ticket.connection) != nullptr; }
  /// Obeys commands that wait, as far as the machine can take them.
  void poll();
  /// What was sent before a stop must not move the machine behind it.
  void give_up_waiting();

 private:
  static constexpr std::size_t kWaitingMax = 64, kWaitingOfOne = 16;  // of all, of one process

  struct Waiting {
    trunnion::command_t command;
    Ticket ticket;
    CommandGate::Sender process;
  };

  void receive(const trunnion::command_t& command);
  void receive_from(const Peer& peer, const trunnion::command_t& command);
  bool may(const Peer& peer, const trunnion::command_t& command, const Ticket& ticket);
  void obey(const trunnion::command_t& command, const Ticket& ticket);
  void wait(const trunnion::command_t& command, const Ticket& ticket, const CommandGate::Sender& process);
  void turn_away(const Ticket& ticket, bool may_answer);
  void reply(const Ticket& ticket, const Answer& answer);
  void send(const Ticket& ticket, const trunnion::acknowledge_t& message);
  trunnion::acknowledge_t message_of(const Ticket& ticket, const Answer& answer) const;

  LocalServer& socket_;
  const AccessRules& access_;
  std::string channel_;
  Obey obey_;
  StatusCount status_count_;
  Ready ready_;
  ReplyCache replies_;
  CommandGate gate_, refusals_;
  std::deque<Waiting> waiting_;
};

}  // namespace trn

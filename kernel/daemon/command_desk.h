#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "hal/lcm_link.h"
#include "kernel/daemon/acknowledge_book.h"

namespace trn {

/// The daemon's side of the command channel: obeys each command once, answers every copy, refuses what has
/// expired. Lives in the thread that handles the link.
class CommandDesk {
 public:
  struct Answer {
    std::int8_t outcome = trunnion::acknowledge_t::ACCEPTED;  ///< as in acknowledge_t
    std::string message;
  };
  /// Which command an answer belongs to.
  struct Ticket {
    std::int64_t client = 0;
    std::int32_t sequence = 0;
  };
  /// Obeys a command, or leaves it at WORKING and calls `finish` later.
  using Obey = std::function<Answer(const trunnion::command_t&, const Ticket&)>;
  /// Count of the next status message.
  using StatusCount = std::function<std::int64_t()>;

  CommandDesk(LcmLink& link, const LcmConfig& config, Obey obey, StatusCount status_count);

  /// The final answer to a command that was left at WORKING.
  void finish(const Ticket& ticket, const Answer& answer);

 private:
  void receive(const trunnion::command_t& command);
  void reply(const Ticket& ticket, const Answer& answer);

  LcmLink& link_;
  std::string channel_;
  Obey obey_;
  StatusCount status_count_;
  AcknowledgeBook book_;
};

}  // namespace trn

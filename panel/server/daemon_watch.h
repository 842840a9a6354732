#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "app/client/daemon_line.h"
#include "hal/lcm_messages.h"

namespace trn {

/// The panel's line to the daemon of one machine: keeps the last of what it tells, carries many commands at a
/// time, and comes back when a daemon does. Waits for nothing. Not thread-safe.
class DaemonWatch {
 public:
  using Clock = std::chrono::steady_clock;
  /// Outcome as the page's interface names it, and the daemon's answer (empty where there was none).
  using Answer = std::function<void(const std::string& outcome, const trunnion::acknowledge_t& answer)>;

  /// `make_line` connects to the daemon. NoAnswer: nobody is there now, and it is tried again.
  explicit DaemonWatch(std::function<std::unique_ptr<DaemonLine>()> make_line);

  /// To be called some hundred times a second: hears what is there, asks again, connects again.
  void step();
  /// `done` is called once, from `step`.
  void send(trunnion::command_t command, Answer done);

  /// Asks for signals of past periods; the answer has the number that this returns. 0: nobody can be asked.
  std::int32_t send(trunnion::scope_request_t request);

  /// Heard within the last second.
  bool connected() const;
  double age_s() const;  ///< of the last status; -1: none was heard
  const std::optional<trunnion::status_t>& status() const { return status_; }
  const std::optional<trunnion::motion_t>& motion() const { return motion_; }
  const std::optional<trunnion::tables_t>& tables() const { return tables_; }
  const std::optional<trunnion::alarms_t>& alarms() const { return alarms_; }

  /// Called from `step` when something new was heard; may be empty.
  std::function<void()> on_status, on_motion, on_tables, on_alarms;
  std::function<void(const trunnion::scope_signals_t&)> on_scope_signals = [](const auto&) {};
  std::function<void(const trunnion::scope_data_t&)> on_scope_data = [](const auto&) {};

 private:
  struct Asked {
    trunnion::command_t command;
    Answer done;
    Clock::time_point heard, sent;
  };

  void connect();
  void answer(const trunnion::acknowledge_t& answer);
  void ask_again();
  void give_up(const std::string& why);

  std::function<std::unique_ptr<DaemonLine>()> make_line_;
  std::unique_ptr<DaemonLine> line_;
  Clock::time_point tried_, status_heard_;
  std::int64_t client_;
  std::int32_t sequence_ = 0, scope_sequence_ = 0;
  std::map<std::int32_t, Asked> asked_;  ///< by sequence
  std::optional<trunnion::status_t> status_;
  std::optional<trunnion::motion_t> motion_;
  std::optional<trunnion::tables_t> tables_;
  std::optional<trunnion::alarms_t> alarms_;
};

}  // namespace trn

#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "app/daemon/worker.h"
#include "app/session/scope_config.h"
#include "app/session/scope_record.h"
#include "app/session/scope_ring.h"
#include "app/session/signals.h"
#include "core/machine.h"
#include "kernel/rt_messages.h"

namespace trn {

/// All signals about a fault as a record: those that nobody knew, and switches that stayed off, are left out.
ScopeRecord record_of(const ScopeRing& ring, const SignalTable& table, const std::string& machine);

/// On every fault, keeps what the scope has of the last seconds and a little after, in a file beside the
/// session's log: LOG.fault1.csv, LOG.fault2.csv and so on. When there are as many as may be, the oldest
/// goes. A thread of its own writes, one file at a time. A fault that comes meanwhile waits for it as long as
/// the scope still has its period; then a warning says that nothing was kept of it.
class FaultKeeper {
 public:
  FaultKeeper(const ScopeConfig& config, const Machine& machine, const SignalTable& table, std::string log);
  /// The file of the last fault is whole then.
  ~FaultKeeper();
  FaultKeeper(const FaultKeeper&) = delete;
  FaultKeeper& operator=(const FaultKeeper&) = delete;

  /// Every report, behind its row in the ring.
  void report(const CycleReport& report, const ScopeRing& ring);

 private:
  void keep(const ScopeRing& ring);
  void wait_for_disk(const ScopeRing& ring);

  ScopeConfig config_;
  std::string machine_, log_;
  double period_s_;
  const SignalTable& table_;
  bool latched_ = false;
  std::uint64_t fault_period_ = 0;
  std::optional<std::uint64_t> due_period_;
  std::optional<Worker> worker_;  ///< none: nothing is kept
};

/// The file for the next fault of this log: a number that none has yet or, when there are `files_max`, that
/// of the oldest.
std::string next_fault_file(const std::string& log, int files_max);

}  // namespace trn

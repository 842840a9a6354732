#pragma once

#include <string>

#include "app/daemon/access.h"
#include "app/daemon/command_gate.h"
#include "app/daemon/fault_keeper.h"
#include "app/session/scope_config.h"
#include "app/session/scope_ring.h"
#include "app/session/signals.h"
#include "core/machine.h"
#include "hal/lcm_link.h"
#include "hal/lcm_messages.h"
#include "hal/local_socket.h"
#include "kernel/rt_messages.h"

namespace trn {

/// Keeps all signals of the last seconds in memory and hands them out, period by period, to whoever may look.
/// The tick knows nothing of it: it lives on the reports, in the thread that handles the socket.
class ScopeServer {
 public:
  static constexpr std::size_t kSignalsMax = 64;

  /// `keep_beside`: the session's log; a fault's last seconds are kept beside it. "": nowhere.
  ScopeServer(LocalServer& socket, const AccessRules& access, const LcmConfig& names, const Machine& machine,
              const SignalTable& table, const ScopeConfig& config, const std::string& keep_beside);

  /// Every report, in order.
  void report(const CycleReport& report);

 private:
  void receive(const trunnion::scope_request_t& request);
  void answer(const trunnion::scope_request_t& request);
  void answer_list(const trunnion::scope_request_t& request);
  void fill(const trunnion::scope_request_t& request, const std::vector<const Signal*>& signals,
            trunnion::scope_data_t& data) const;
  std::string find(const trunnion::scope_request_t& request, std::vector<const Signal*>& signals) const;

  LocalServer& socket_;
  const AccessRules& access_;
  const LcmConfig names_;
  const SignalTable& table_;
  SignalSampler sampler_;
  ScopeRing ring_;
  FaultKeeper keeper_;
  CommandGate gate_;
};

}  // namespace trn

#pragma once

#include <array>

#include "kernel/rt_messages.h"
#include "kernel/setpoint_chain.h"

namespace trn {

/// Logs what the corrections behind the plan say of themselves, each text once.
class CorrectionWarnings {
 public:
  CorrectionWarnings() { last_.fill(""); }
  /// True if one of them says something new.
  bool hear(const SetpointChain& chain, const CycleReport& report);

 private:
  std::array<const char*, kMaxSetpointCorrections> last_;
};

}  // namespace trn

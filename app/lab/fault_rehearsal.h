#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/fault.h"

namespace trn {

/// What became of one kind of trouble with the drives' bus. Times in periods of the tick.
struct RehearsedFault {
  std::string cause;
  Fault wanted = Fault::kOk, fault = Fault::kOk;  ///< kOk: it must be lived through
  int to_fault = -1;                              ///< from the cause to the latched fault; -1: none
  int to_rest = -1;                               ///< from the cause until no drive moves any more
  double crept = 0;                               ///< way of any drive in the second after that, mm or rad
  bool keeps_position = true, kept_position = true;
  int to_recover = -1;  ///< from `reset` to all drives enabled; -1: not within 10 s
  std::string message;  ///< the operator's
  bool good() const;
};

/// Rehearses the fault table: for every row a machine of the config with emulated drives is brought up,
/// homed and put in motion, then the trouble happens; afterwards it is mended and the machine reset. The real
/// master, the real tick and the real reactions; in memory, deterministic. `on_row` sees each row when it is
/// done. std::runtime_error if the machine's drives are on no CAN bus; ConfigError as `assemble`.
std::vector<RehearsedFault> rehearse_faults(const std::string& config,
                                            const std::function<void(const RehearsedFault&)>& on_row);

/// A bring-up in which the drive refuses one object.
struct RefusedStep {
  std::string object, message;
  std::string warning;  ///< of a drive that comes up without it
  bool moved = false, recovered = false;
};
std::vector<RefusedStep> rehearse_refusals(const std::string& config);

}  // namespace trn

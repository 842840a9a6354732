#pragma once

#include "app/lab/fault_rehearsal.h"

namespace trn {

/// The fault table's Modbus rows: the machine of the config with simulated drives, its devices emulated on
/// loopback TCP and pseudo-terminals, spindle on and in motion; then a device falls silent, answers by
/// halves, late, or lies. The real Modbus side, the real tick, in real time; periods are those of the tick. A
/// device that is not `required` must be lived without. std::runtime_error if the machine has no Modbus
/// devices; ConfigError as `assemble`.
std::vector<RehearsedFault> rehearse_modbus_faults(const std::string& config,
                                                   const std::function<void(const RehearsedFault&)>& on_row);

}  // namespace trn

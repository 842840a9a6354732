#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/config.h"
#include "core/machine.h"
#include "core/realtime.h"

namespace trn {

/// States of the machine that a signal may follow, as "machine.enabled".
enum class MachineSignal : std::uint8_t {
  kEnabled,
  kMoving,
  kRunning,
  kFault,
  kHomed,
  kSpindle,
  kMist,
  kFlood,
  kCount
};

/// A digital input or output of the machine by its name in a config: "io.input.3", "io.output.2",
/// "drive.X.input.16" (a bit of 0x60FD), "drive.X.output.0" (a bit of 0x60FE); or a state of the machine,
/// whose number is its MachineSignal.
struct SignalName {
  enum class Kind : std::uint8_t { kIoInput, kIoOutput, kDriveInput, kDriveOutput, kMachine };
  Kind kind = Kind::kIoInput;
  int joint = -1;  ///< of a drive's
  int number = 0;
  bool is_input() const TRN_RT { return kind == Kind::kIoInput || kind == Kind::kDriveInput; }
  bool of_drive() const TRN_RT { return kind == Kind::kDriveInput || kind == Kind::kDriveOutput; }
  bool of_io() const { return kind == Kind::kIoInput || kind == Kind::kIoOutput; }
  bool operator==(const SignalName&) const = default;
};

std::string to_string(const SignalName& name, const Machine& machine);
/// ConfigError with what would be legal.
SignalName read_signal_name(const Machine& machine, const ConfigTable& table, std::string_view key);

}  // namespace trn

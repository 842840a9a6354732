#pragma once

#include <vector>

#include "core/config.h"
#include "core/machine.h"
#include "core/ports.h"
#include "core/units.h"
#include "sim/simulated_spindle.h"
#include "sim/touch_table.h"

namespace trn {

/// Devices beside the drives, stepped once an exchange; deterministic: inputs wired to outputs, inputs that
/// change by a script, a probe that touches shapes on the table, and a spindle.
class SimulatedIo final : public MachineIo {
 public:
  /// Input `input` follows output `output`, `delay` periods later.
  struct Wire {
    int output = 0, input = 0;
    std::uint32_t delay_periods = 0;
    bool analog = false;
  };
  /// An input changes in a given period.
  struct ScriptedInput {
    std::uint64_t period = 0;
    int input = 0;
    bool analog = false;
    double value = 0;
  };
  struct Config {
    std::vector<Wire> wires;
    std::vector<ScriptedInput> script;
    TouchTable::Config table;
    TouchSwitch::Config touch;
    SimulatedSpindle::Config spindle;
  };

  /// `kinematics` must outlive this.
  SimulatedIo(const Config& config, const Kinematics& kinematics);

  void exchange(const IoOutputs& outputs, const IoPlace& place, IoInputs& inputs) TRN_RT override;

 private:
  /// A wire, and since when its output has had its present value.
  struct LiveWire {
    Wire wire;
    double value = 0;
    std::uint64_t since = 0;
  };
  void follow_wires(const IoOutputs& outputs) TRN_RT;
  void run_script() TRN_RT;
  void set(int input, bool analog, double value) TRN_RT;

  std::vector<LiveWire> wires_;
  std::vector<ScriptedInput> script_;
  TouchTable table_;
  TouchSwitch touch_;
  SimulatedSpindle spindle_;
  IoInputs inputs_;
  std::uint64_t period_ = 0;
};

/// Reads the keys of `io` (the section [io]); ConfigError as ConfigTable.
SimulatedIo::Config read_simulated_io(const Machine& machine, const ConfigTable& io);

}  // namespace trn

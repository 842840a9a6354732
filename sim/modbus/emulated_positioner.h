#pragma once

#include <memory>
#include <vector>

#include "core/config.h"
#include "core/machine.h"
#include "hal/modbus/modbus_drives.h"
#include "sim/canopen/emulated_drive.h"
#include "sim/canopen/object_store.h"
#include "sim/modbus/emulated_line.h"
#include "sim/simulated_joint.h"

namespace trn {

/// The drives of a ModbusDrivesConfig, each behind its registers: the state machine and modes of CiA 402 on a
/// simulated joint (keys of [drives.emulation] as for simulated drives).
class EmulatedPositioners {
 public:
  EmulatedPositioners(const Machine& machine, const ModbusDrivesConfig& config, const ConfigTable& drives);

  /// Lets `dt_s` pass, in steps of the drives' own clock (1 ms).
  void step(double dt_s);
  EmulatedDrive& drive(std::size_t axis) { return *axes_[axis].drive; }
  void trouble(std::size_t axis, const EmulatedLine::Trouble& trouble);
  EmulatedLine& line(std::size_t index) { return *lines_[index]; }

 private:
  struct Axis {
    ModbusAxisConfig config;
    std::unique_ptr<ObjectStore> store;
    std::unique_ptr<EmulatedDrive> drive;
  };
  void take_command(Axis& axis);
  void give_answer(Axis& axis);

  std::vector<std::unique_ptr<EmulatedLine>> lines_;
  std::vector<Axis> axes_;
  double left_s_ = 0;
};

/// Keys of [drives.emulation] of a machine with Modbus drives, at the drives' own clock.
SimulatedJoint::Config read_positioner_plant(const Machine& machine, const ConfigTable& drives, int joint);

}  // namespace trn

#include "app/session/make_drives.h"

#include <algorithm>
#include <string>

#include "core/axes.h"
#include "core/config.h"
#include "hal/can/can_config.h"
#include "hal/can/can_drives.h"
#include "hal/can/socket_can.h"
#include "hal/loopback.h"
#include "hal/modbus/modbus_drives.h"
#include "sim/canopen/emulated_can.h"
#include "sim/canopen/emulated_probe.h"
#include "sim/micromill/micro_mill_drives.h"
#include "sim/modbus/emulated_positioner.h"
#include "sim/simulated_drives.h"

namespace trn {

namespace {

// Every joint at zero, or at the end of its range nearest to it.
JointVec rest_position(const Machine& machine) {
  JointVec q(static_cast<Eigen::Index>(machine.joints.size()));
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const JointLimit& limit = machine.joints[static_cast<std::size_t>(i)].limit;
    q[i] = std::clamp(0.0, limit.min, limit.max);
  }
  return q;
}

// In `run`, simulated drives stand where slow ones would be; whoever serves the real lines knows the same
// keys.
std::unique_ptr<Drives> make_modbus_drives(const Machine& machine, const ConfigTable& drives, Field field) {
  const ModbusDrivesConfig config = read_modbus_drives(machine, drives);
  read_positioner_plant(machine, drives, 0);
  if (field == Field::kReal) return std::make_unique<ModbusDrives>(config);
  const auto section = drives.table_if("emulation");
  return std::make_unique<SimulatedDrives>(
      read_simulated_drives(machine, section ? *section : parse_config("", machine.root.file())));
}

}  // namespace

std::string drives_type(const Machine& machine) {
  return machine.root.table("drives").choice("type",
                                             {"loopback", "simulated", "canopen", "modbus", "micro_mill"});
}

std::unique_ptr<Drives> make_drives(const Machine& machine, Field field) {
  const ConfigTable drives = machine.root.table("drives");
  const std::string type = drives_type(machine);
  if (type == "loopback") return std::make_unique<LoopbackDrives>(rest_position(machine));
  if (type == "simulated") return std::make_unique<SimulatedDrives>(read_simulated_drives(machine, drives));
  if (type == "micro_mill") return std::make_unique<MicroMillDrives>(read_micro_mill_drives(machine, drives));
  if (type == "modbus") return make_modbus_drives(machine, drives, field);
  if (field == Field::kEmulated) return std::make_unique<EmulatedCanDrives>(machine, drives);
  const CanDrivesConfig config = read_can_drives(machine, drives);
  make_emulated_nodes(machine, config, drives);  // these know the keys of the emulation
  EmulatedProbe(machine, drives);
  return std::make_unique<CanDrives>(config, std::make_unique<SocketCanOpener>());
}

}  // namespace trn

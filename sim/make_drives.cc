#include "sim/make_drives.h"

#include <algorithm>

#include "hal/can/can_drives.h"
#include "hal/can/socket_can.h"
#include "hal/loopback.h"
#include "sim/canopen/emulated_can.h"
#include "sim/micromill/micro_mill_drives.h"
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

}  // namespace

std::unique_ptr<Drives> make_drives(const Machine& machine, Field field) {
  const ConfigTable drives = machine.root.table("drives");
  const std::string type = drives.choice("type", {"loopback", "simulated", "canopen", "micro_mill"});
  if (type == "loopback") return std::make_unique<LoopbackDrives>(rest_position(machine));
  if (type == "simulated") return std::make_unique<SimulatedDrives>(read_simulated_drives(machine, drives));
  if (type == "micro_mill") return std::make_unique<MicroMillDrives>(read_micro_mill_drives(machine, drives));
  if (field == Field::kEmulated) return std::make_unique<EmulatedCanDrives>(machine, drives);
  const CanDrivesConfig config = read_can_drives(machine, drives);
  make_emulated_nodes(machine, config, drives);  // knows the keys of the emulation
  return std::make_unique<CanDrives>(config, std::make_unique<SocketCanOpener>());
}

}  // namespace trn

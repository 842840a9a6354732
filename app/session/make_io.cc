#include "app/session/make_io.h"

#include "sim/simulated_io.h"

namespace trn {

std::unique_ptr<MachineIo> make_io(const Machine& machine, const ConfigTable& io,
                                   const Kinematics& kinematics) {
  const bool real = io.choice("type", {"simulated", "modbus"}, "simulated") != "simulated";
  const std::optional<ConfigTable> emulation = real ? io.table_if("emulation") : io;
  const ConfigTable keys = emulation ? *emulation : parse_config("", machine.root.file());
  return std::make_unique<SimulatedIo>(read_simulated_io(machine, keys), kinematics);
}

}  // namespace trn

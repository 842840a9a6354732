#include "sim/make_io.h"

#include "sim/simulated_io.h"

namespace trn {

std::unique_ptr<MachineIo> make_io(const Machine& machine, const ConfigTable& io,
                                   const Kinematics& kinematics) {
  io.choice("type", {"simulated"}, "simulated");
  return std::make_unique<SimulatedIo>(read_simulated_io(machine, io), kinematics);
}

}  // namespace trn

#pragma once

#include <vector>

#include "core/config.h"
#include "core/machine.h"
#include "hal/can/can_node_config.h"
#include "hal/can/gantry.h"

namespace trn {

/// The joints that have a [[drives.gantry]], each once; ConfigError as `read_can_drives`.
std::vector<int> read_gantry_joints(const Machine& machine, const ConfigTable& drives);

/// Once all nodes are read: the gantries themselves, and what their motors must have in common. The nodes
/// learn that they belong to one.
std::vector<Gantry::Config> read_gantries(const Machine& machine, const ConfigTable& drives,
                                          const std::vector<CanNodeConfig*>& nodes);

}  // namespace trn

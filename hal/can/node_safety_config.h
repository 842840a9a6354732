#pragma once

#include "core/config.h"
#include "core/machine.h"
#include "hal/can/node_link.h"

namespace trn {

/// What sections [safety] and [[signal]] and the node's key `sto` say of a drive: its holding brake, how it
/// tells of Safe Torque Off, which of its inputs and outputs are wired. `node.joint` is read already.
/// ConfigError as `read_can_drives`.
void read_node_safety(const Machine& machine, const ConfigTable& table, NodeLink::Config& node);

}  // namespace trn

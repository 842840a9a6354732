#pragma once

#include <string>
#include <vector>

#include "core/config.h"
#include "core/machine.h"
#include "hal/can/can_timing.h"
#include "hal/can/drive_units.h"
#include "hal/can/eds.h"
#include "hal/can/node_link.h"
#include "hal/can/node_setup.h"
#include "hal/can/pdo.h"

namespace trn {

/// Periods between PDOs that need not be fast; these are behind setpoints and feedback in priority.
inline constexpr int kSlowPeriods = 10;

/// One drive on a bus.
struct CanNodeConfig {
  ObjectDictionary dictionary;
  NodeLink::Config link;
  NodeSetup::Config setup;
  double home = 0;    ///< position at the home point, mm or rad
  double square = 0;  ///< of which, how far this motor's switch stands beyond a square gantry
  PdoHabits pdo_habits;
  bool offset_is_zero = false;  ///< 0x607C is where the zero lies, seen from the home point
  int homing_method = 0;
  DriveUnits units;
  double counts_per_revolution = 0;        ///< as the config says it; 0: the data sheet does
  std::vector<std::string> warnings = {};  ///< what the config asks for and the data sheet does not have
};

/// The bus a node is on, as far as the node is concerned.
struct NodeBus {
  std::string interface;
  bool fd = false;
};

/// Reads one [[drives.node]] and the data sheet it names (beside the config file), computes its PDOs and what
/// it is told at bring-up; refuses what cannot work: ConfigError with file, line and column.
CanNodeConfig read_can_node(const Machine& machine, const CanTiming& timing, const NodeBus& bus,
                            const ConfigTable& table);

}  // namespace trn

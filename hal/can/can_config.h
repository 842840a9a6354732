#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/axes.h"
#include "core/config.h"
#include "core/machine.h"
#include "hal/can/bus_budget.h"
#include "hal/can/can_node_config.h"
#include "hal/can/gantry.h"

namespace trn {

/// Drives on one bus: every joint may have two motors.
inline constexpr std::size_t kNodesMax = 2 * kMaxJoints;

/// One bus and what is on it.
struct CanBusConfig {
  std::string interface;
  double bitrate = 1e6;
  bool fd = false;          ///< PDOs in CAN FD frames
  double data_bitrate = 0;  ///< of their data; 0: no FD
  std::vector<CanNodeConfig> nodes;
  BusBudget budget;
};

/// Section [drives] with type = "canopen".
struct CanDrivesConfig {
  double period_s = 0;
  int master_id = 127;
  int sync_counter = 0;                 ///< overflow of the SYNC counter; 0: SYNC without one
  std::uint32_t heartbeat_periods = 0;  ///< of the master's own heartbeat; 0: none
  std::uint32_t overload_max = 3;       ///< periods in a row in which frames could not be sent
  int touch_periods = 0;                ///< as TouchDrives::touch_periods
  std::vector<CanBusConfig> buses;
  std::vector<Gantry::Config> gantries;  ///< joints with several motors

  /// The joint that a node drives; -1: there is no such node.
  int joint_of(std::size_t bus, int id) const;
};

/// Reads the section, the data sheets it names (beside the config file), computes the PDOs and the bus
/// budgets, and refuses what cannot work: ConfigError with file, line and column.
CanDrivesConfig read_can_drives(const Machine& machine, const ConfigTable& drives);

}  // namespace trn

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hal/can/cia402.h"
#include "hal/can/eds.h"
#include "hal/can/node_setup.h"
#include "hal/can/pdo.h"

namespace trn {

/// What a CiA 402 drive is told at bring-up; lengths in counts.
struct DriveSetup {
  std::string name;
  double period_s = 0;
  Cia402Mode mode = Cia402Mode::kCyclicPosition;
  int master_id = 127, heartbeat_ms = 0, heartbeat_timeout_ms = 0;
  int sync_counter = 0;  ///< overflow of the counter in SYNC; 0: none
  bool homes = true;
  int homing_method = 5;
  std::int64_t home_counts = 0, search_counts_s = 0, index_counts_s = 0, acceleration_counts_s2 = 0,
               velocity_counts_s = 0, quick_stop_counts_s2 = 0;
  std::int64_t vendor = 0, product = 0;  ///< 0: any
};

/// Identity, heartbeats, PDOs (written, then read back), mode, ramps and homing, in the order of the bus.
std::vector<SetupStep> setup_steps(const DriveSetup& setup, const ObjectDictionary& dictionary,
                                   const std::vector<Pdo>& rpdos, const std::vector<Pdo>& tpdos);

/// The consumer heartbeat entry: the master's id and its heartbeat's time limit, which no drive holds at
/// power-on.
SetupStep signature_step(const DriveSetup& setup);

}  // namespace trn

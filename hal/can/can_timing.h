#pragma once

#include <cstdint>

#include "core/config.h"

namespace trn {

/// What section [drives] says of all nodes alike.
struct CanTiming {
  int heartbeat_ms = 0, heartbeat_timeout_ms = 0, missed_max = 0, master_id = 127;
  int guard_ms = 0, life_time_factor = 3;  ///< of nodes that have no heartbeats both ways
  int sdo_timeout_ms = 0, boot_timeout_ms = 0, retries = 0;
  int sync_counter = 0;
  bool touch = false;            ///< the touch probe is on the drives' own inputs
  unsigned touch_input_bit = 0;  ///< of 0x60FD
  double enable_timeout_s = 0, homing_timeout_s = 0, period_s = 0;
};

/// ConfigError with file, line and column, as all readers.
CanTiming read_can_timing(const ConfigTable& drives, double period_s);

}  // namespace trn

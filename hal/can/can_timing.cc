#include "hal/can/can_timing.h"

#include <fmt/format.h>

#include "hal/can/nmt.h"

namespace trn {

CanTiming read_can_timing(const ConfigTable& drives, double period_s) {
  CanTiming t;
  t.period_s = period_s;
  t.master_id = static_cast<int>(drives.integer("master_id", 127, Range{1, kNodeIdMax}));
  t.heartbeat_ms = static_cast<int>(drives.integer("heartbeat_ms", 50, Range{0, 10000}));
  // Three heartbeats by default: one that is late behind other traffic is no loss of a drive.
  t.heartbeat_timeout_ms =
      static_cast<int>(drives.integer("heartbeat_timeout_ms", 3L * t.heartbeat_ms, Range{0, 30000}));
  if (t.heartbeat_ms > 0 && t.heartbeat_timeout_ms <= t.heartbeat_ms)
    throw drives.error(
        "heartbeat_timeout_ms",
        fmt::format("'heartbeat_timeout_ms' must be longer than heartbeat_ms ({})", t.heartbeat_ms));
  // A drive that cannot hear the master's heartbeat is guarded as often as the others beat.
  t.guard_ms = static_cast<int>(drives.integer("guarding_ms", t.heartbeat_ms, Range{0, 10000}));
  t.life_time_factor = static_cast<int>(drives.integer("life_time_factor", 3, Range{1, 255}));
  t.missed_max = static_cast<int>(drives.integer("missed_max", 3, Range{1, 100}));
  t.sdo_timeout_ms = static_cast<int>(drives.integer("sdo_timeout_ms", 500, Range{1, 60000}));
  t.boot_timeout_ms = static_cast<int>(drives.integer("boot_timeout_ms", 3000, Range{10, 600000}));
  t.retries = static_cast<int>(drives.integer("sdo_retries", 1, Range{0, 10}));
  t.enable_timeout_s = drives.number("enable_timeout_s", 2.0, kPositive);
  t.homing_timeout_s = drives.number("homing_timeout_s", 120.0, kPositive);
  t.sync_counter = static_cast<int>(drives.integer("sync_counter", 0, Range{0, 240}));
  if (t.sync_counter == 1)
    throw drives.error("sync_counter", "'sync_counter' is 0, or 2 to 240 (CiA 301, 7.5.2.22)");
  t.touch = drives.choice("probe", {"none", "drive"}, "none") == "drive";
  t.touch_input_bit = static_cast<unsigned>(drives.integer("probe_input_bit", 16, Range{0, 31}));
  return t;
}

}  // namespace trn

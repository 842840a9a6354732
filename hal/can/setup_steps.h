#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/can/cia402.h"
#include "hal/can/drive_units.h"
#include "hal/can/eds.h"
#include "hal/can/node_setup.h"
#include "hal/can/pdo.h"

namespace trn {

/// 0x60C2: so long is the time between two setpoints, value * 10^exponent s.
struct InterpolationTime {
  int value = 0, exponent = 0;
};

/// What a CiA 402 drive is told at bring-up; lengths in counts, speeds and ramps in the drive's own units.
struct DriveSetup {
  std::string name;
  double period_s = 0;
  Cia402Mode mode = Cia402Mode::kCyclicPosition;
  int master_id = 127;
  int heartbeat_ms = 0;          ///< the drive's own; 0: none
  int heartbeat_timeout_ms = 0;  ///< after which the drive misses the master's; 0: it does not watch them
  int guard_ms = 0, life_time_factor = 0;  ///< node guarding; 0: none
  int sync_counter = 0;                    ///< overflow of the counter in SYNC; 0: none
  std::optional<InterpolationTime> interpolation;
  bool holds_at_stop = false;    ///< behind a quick stop it stays in Quick Stop Active until it is told
  std::int64_t output_mask = 0;  ///< bits of 0x60FE that the master switches
  bool endless = false;          ///< without a range
  bool homes = true;
  int homing_method = 5;
  std::int64_t home_counts = 0, search_speed = 0, index_speed = 0, acceleration = 0, velocity = 0,
               quick_stop = 0;
  std::int64_t range_low = 0, range_high = 0;  ///< of the joint, in the drive's own direction
  std::int64_t following_counts = 0;           ///< following error that is the master's fault; 0: not watched
  std::optional<int> following_ms;  ///< 0x6066, how long that error may last; none: as the drive has it
  /// 0x605B, 0x605C, 0x605D: what it does when it is told to shut down, to let go, to halt.
  std::optional<int> at_shutdown, at_disable, at_halt;
  std::int64_t motor_rpm = 0;  ///< at the joint's speed limit; 0: not known
  bool sets_limits = false;    ///< the drive is told the range and the following error
  PdoOrder pdo_order = PdoHabits{}.order;
  std::vector<DriveUnits::Object> units;
  std::int64_t vendor = 0, product = 0;  ///< 0: any
  std::vector<std::string> skip;         ///< "0x6085" or "0x60C2:2": never written
};

/// The form of `period_s` that most drives take, whole milliseconds if it can be, within the limits that the
/// data sheet gives for 0x60C2 (CiA 402-2, 12.4.4); nothing if there is none, or no such object.
std::optional<InterpolationTime> interpolation_time(double period_s, const ObjectDictionary& dictionary);

/// Identity, heartbeats or guarding, PDOs (written, then read back), mode, ramps and homing, in the order of
/// the bus. What only other modes use is left out.
std::vector<SetupStep> setup_steps(const DriveSetup& setup, const ObjectDictionary& dictionary,
                                   const std::vector<Pdo>& rpdos, const std::vector<Pdo>& tpdos);

/// Takes out what `skip` names, and what it names with a sub-index; checks stay.
void leave_out(const std::vector<std::string>& skip, std::vector<SetupStep>& steps);

/// What tells a drive that was set up from one that was restarted since: the consumer heartbeat, else another
/// of `steps` whose power-on value by the data sheet is another one. Without any it asks for the device type
/// and every drive counts as restarted.
SetupStep signature_step(const std::vector<SetupStep>& steps, const ObjectDictionary& dictionary);

}  // namespace trn

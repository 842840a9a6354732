#pragma once

#include <optional>
#include <vector>

#include "core/axes.h"
#include "core/config.h"
#include "core/joint_model.h"
#include "hal/can/cia402.h"
#include "hal/can/cia402_axis.h"
#include "hal/can/drive_units.h"
#include "hal/can/eds.h"
#include "hal/can/sdo.h"

namespace trn {

/// Objects of feed-forward for one drive (CiA 402-2, 0x60B1 and 0x60B2).
struct FeedForwardObjects {
  std::vector<ObjectKey> mapped;  ///< that go to it with every setpoint
  std::vector<ObjectKey>
      missing;  ///< that its mode has and the config asks for, and its data sheet does not allow
};
FeedForwardObjects feed_forward_objects(const ObjectDictionary& dictionary, Cia402Mode mode, int joint,
                                        const std::optional<FeedForwardConfig>& config);

/// Reads what force the drive's thousandths are, and the loops of cyclic torque mode: `axis.torque_units` and
/// `axis.torque_loop`. `forces`: the drive is told some, so that this must be known. ConfigError.
void read_torque(const Joint& joint, const ConfigTable& table, const ObjectDictionary& dictionary,
                 const DriveUnits& units, bool forces, Cia402Axis::Config& axis);

}  // namespace trn

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

/// The objects of feed-forward that go to the drive of a joint with every setpoint: those that its mode has,
/// its data sheet lets be mapped, and the config asks for (CiA 402-2, 0x60B1 and 0x60B2).
std::vector<ObjectKey> feed_forward_objects(const ObjectDictionary& dictionary, Cia402Mode mode, int joint,
                                            const std::optional<FeedForwardConfig>& config);

/// Reads what force the drive's thousandths are, and the loops of cyclic torque mode: `axis.torque_units` and
/// `axis.torque_loop`. `forces`: the drive is told some, so that this must be known. ConfigError.
void read_torque(const Joint& joint, const ConfigTable& table, const ObjectDictionary& dictionary,
                 const DriveUnits& units, bool forces, Cia402Axis::Config& axis);

}  // namespace trn

#pragma once

#include "app/import/imported_machine.h"
#include "app/import/joint_section.h"

namespace trn {

/// HOME, HOME_OFFSET and the speeds of a joint whose range is known; tells what lies beyond the range.
void read_homing(const JointSection& section, ImportedJoint& joint, ImportedMachine& machine);

/// Numbers of a simulated drive, in the joint's unit. It looks for its switch downwards, backs off it, and
/// stands where it has found the index above.
struct SimulatedHoming {
  double home = 0, index_distance = 0;
  double search_speed = 0, index_speed = 0;
};

/// The place in the joint's range that is nearest to `at`. The range of a rotary joint is rounded once more
/// where the config is read, so that its very end is no legal place.
double inside_range(const ImportedJoint& joint, double at);

/// Such that homing ends at `stand` and inside the joint's range, whatever the joint's speeds are.
SimulatedHoming simulated_homing(const ImportedJoint& joint, double stand, double period_s);

/// The longest search of the joint: from one end of its range to the other.
double search_time_s(const ImportedJoint& joint, const SimulatedHoming& homing);

}  // namespace trn

#pragma once

#include <vector>

#include "app/import/imported_machine.h"
#include "app/import/ini_file.h"
#include "app/import/joint_section.h"

namespace trn {

/// What bounds a joint beside its own section. Of all limits the narrowest holds.
struct LimitSections {
  std::vector<JointSection> axis = {};    ///< [AXIS_x] of a letter that is this joint's alone; at most one
  std::vector<JointSection> motors = {};  ///< [JOINT_n] of further motors of the same axis
};

/// Reads range, velocity and acceleration of a joint. Limits of the path in [TRAJ] hold for linear joints.
void read_limits(const JointSection& section, const LimitSections& more, ImportedJoint& joint,
                 ImportedMachine& machine);

/// Tells where the path may now be faster than [TRAJ] let it be; behind all joints.
void note_path_limits(const IniFile& ini, ImportedMachine& machine);

}  // namespace trn

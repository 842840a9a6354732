#pragma once

#include "app/import/imported_machine.h"
#include "app/import/ini_file.h"
#include "app/import/kinematics_module.h"
#include "app/import/kinematics_reader.h"

namespace trn {

/// Reads the sections [JOINT_N] and [AXIS_L] into the machine's joints: one for each axis letter that there
/// is a word for, or six legs. Lengths must have their units already.
void read_joints(const IniFile& ini, const KinematicsModule& module, ImportedMachine& machine);

}  // namespace trn

#pragma once

#include "app/import/hal_setup.h"
#include "app/import/imported_machine.h"
#include "app/import/ini_file.h"
#include "app/import/kinematics_module.h"

namespace trn {

/// The legs of genhexkins: leg i is as long as p - (0, 0, s) + R (a_i + (0, 0, s)) - b_i, where p is
/// LinuxCNC's position, R = Rz(C) Ry(B) Rx(A), s the spindle's offset, a_i and b_i the joints of platform and
/// base. (Manual of the module, and measured on it.) The frame of the base is moved so that words mean the
/// same.
void place_hexapod(const KinematicsModule& module, const IniFile& ini, const HalSetup& hal,
                   ImportedMachine& machine);

}  // namespace trn

#pragma once

#include "app/import/hal_setup.h"
#include "app/import/imported_machine.h"
#include "app/import/ini_file.h"
#include "app/import/kinematics_module.h"
#include "app/import/kinematics_reader.h"

namespace trn {

/// What G-code leaves to the machine: folders of sub-programs, M codes of the user's own, the words that
/// switch RTCP, the path mode of the start; tool changes, spindle, inputs and outputs.
void read_program(const IniFile& ini, const HalSetup& hal, const KinematicsModule& module,
                  ImportedMachine& machine);

}  // namespace trn

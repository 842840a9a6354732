#pragma once

#include "app/import/hal_setup.h"
#include "app/import/imported_machine.h"
#include "app/import/ini_file.h"

namespace trn {

/// What INI and HAL say of the machine, with a note for everything that was chosen or left out. ImportError
/// with the place of what cannot be, ImportRefusal for kinematics without counterpart.
ImportedMachine read_linuxcnc_machine(const IniFile& ini, const HalSetup& hal);

}  // namespace trn

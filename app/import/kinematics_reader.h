#pragma once

#include <string>
#include <vector>

#include "app/import/hal_setup.h"
#include "app/import/import_place.h"
#include "app/import/imported_machine.h"
#include "app/import/ini_file.h"
#include "app/import/kinematics_module.h"

namespace trn {

/// Finds the module in [KINS]KINEMATICS or `loadrt` and says which joint is which axis. ImportRefusal for a
/// module without counterpart, with the reason; ImportError for letters that cannot be.
KinematicsModule read_kinematics_module(const IniFile& ini, const HalSetup& hal);

/// Puts the axes into the machine's branches, or the legs into its hexapod. Needs the joints of `machine`.
void place_axes(const KinematicsModule& module, const IniFile& ini, const HalSetup& hal,
                ImportedMachine& machine);

}  // namespace trn

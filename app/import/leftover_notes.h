#pragma once

#include "app/import/hal_setup.h"
#include "app/import/imported_machine.h"
#include "app/import/ini_file.h"

namespace trn {

/// Notes for all that nobody has asked for: keys of the INI by section, modules, programs and signals of HAL
/// by subject, files that were not read.
void note_leftovers(const IniFile& ini, const HalSetup& hal, ImportedMachine& machine);

}  // namespace trn

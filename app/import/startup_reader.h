#pragma once

#include "app/import/imported_machine.h"
#include "app/import/ini_file.h"

namespace trn {

/// What is in force when a program begins: unit, path mode and tolerances, from RS274NGC_STARTUP_CODE, the
/// machine's unit and the tolerances of arcs. What has no counterpart is told.
void read_startup(const IniFile& ini, ImportedMachine& machine);

}  // namespace trn

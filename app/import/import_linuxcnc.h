#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/import/import_place.h"
#include "app/import/imported_machine.h"

namespace trn {

/// A machine of LinuxCNC, ready to be written: the texts of config, tool table (.tbl) and variables (.var). A
/// table that the INI does not name, or that is not there yet, has no tools, and such variables are all 0.
struct ImportedFiles {
  ImportedMachine machine;
  std::string config, tools, variables;
  std::vector<std::string> read;  ///< every file that was read
};

/// Reads the INI at `path` and all that it names; `library` is the folder of LinuxCNC's own HAL files, with a
/// "/" behind it. ImportError with file, line and column for what cannot be understood, ImportRefusal for a
/// machine without counterpart.
ImportedFiles import_linuxcnc(const std::string& path, const ImportReader& read, const std::string& library);

/// Axes and notes for programs: lengths mm, angles degrees.
nlohmann::ordered_json import_json(const ImportedFiles& files);

}  // namespace trn

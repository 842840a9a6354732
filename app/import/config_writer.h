#pragma once

#include <string>

#include "app/import/imported_machine.h"

namespace trn {

/// The machine as a config, with each note as a comment where it belongs.
std::string config_text(const ImportedMachine& machine);

/// A note on one line: "mill.ini:12:1: what: why; to do: ...".
std::string note_line(const ImportNote& note);

}  // namespace trn

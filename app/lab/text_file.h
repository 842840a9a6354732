#pragma once

#include <string>

namespace trn {

/// Writes a result that somebody asked for: a picture, a table, a section of a config. OutputError "PATH:
/// cannot write this file: WHY".
void write_text_file(const std::string& path, const std::string& text);

/// Throws what `write_text_file` would, before the work whose result is written there; "" is nothing to
/// write. Leaves what is there as it is.
void check_text_file(const std::string& path);

/// Makes a folder for results, and those above it, unless it is there. OutputError.
void make_result_folder(const std::string& path);

}  // namespace trn

#pragma once

#include <string>
#include <string_view>

#include "interp/gcode/parameters.h"

namespace trn {

/// The numbered parameters of LinuxCNC's .var form: one "number<TAB>value" a line, ascending.
/// ProgramError "file:line:column: message" for anything else.
void parse_parameters(std::string_view text, const std::string& name, Parameters& parameters);
void load_parameters(const std::string& path, Parameters& parameters);

/// The parameters a control keeps over night (positions, offsets, the tool in the spindle, user's
/// own 31..5000 that are not 0).
std::string parameters_text(const Parameters& parameters);
/// On the disk when it returns; a power cut leaves the old or the new one (core/safe_file.h).
void save_parameters(const std::string& path, const Parameters& parameters);

/// Whole file, regular and up to 64 MB; ProgramError if it cannot be read, or written as `write_file_safely`
/// does.
std::string read_text_file(const std::string& path);
void write_text_file(const std::string& path, std::string_view text);

}  // namespace trn

#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "interp/gcode/tool_table.h"

namespace trn {

/// The file of LinuxCNC's parameters `path` with each line as "number value", or empty where LinuxCNC passes
/// over it; `left_out` has those lines. ImportError for numbers that do not rise, since LinuxCNC refuses
/// them as well.
std::string readable_variables(std::string_view text, const std::string& path,
                               std::vector<LeftOutLine>& left_out);

}  // namespace trn

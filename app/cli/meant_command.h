#pragma once

#include <string>
#include <vector>

namespace trn {

/// What somebody wants who writes a file, a line of G-code, or a word of another control in the place of a
/// command, as {"part.ngc"}, {"G0", "X10"}, {"cancel"}: the command line that does it, as a half sentence.
/// "" if nobody knows. `words` begin with that one and have all that follow it.
std::string meant_command(const std::vector<std::string>& words);

/// Whether a word begins a line of G-code, as "G0" and "x-5".
bool is_gcode(const std::string& word);

}  // namespace trn

#pragma once

#include <string>

#include "interp/gcode/g_code.h"
#include "interp/gcode/settings.h"

namespace trn {

/// The codes in force, as a program would write them, G codes first: "G1 G17 G21 G90 G91.1 G94 G54 G43 G98
/// G64 P0.01 G40 G97 M3 M8 M48". `cutter_comp`: G40, G41 or G42.
std::string active_codes(const Settings& settings, GCode cutter_comp);

}  // namespace trn

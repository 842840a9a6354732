#pragma once

#include "hal/lcm_messages.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"

namespace trn {

/// Offsets and tools for people; time_us is left to who sends it. `unit_mm`: of lengths in parameters. As
/// many tools as have room in a packet.
trunnion::tables_t tables_of(const Parameters& parameters, const ToolTable& tools, double unit_mm);

}  // namespace trn

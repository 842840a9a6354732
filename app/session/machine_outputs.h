#pragma once

#include <optional>

#include "app/session/assembly.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/settings.h"
#include "interp/gcode/tool_table.h"

namespace trn {

/// What of spindle and coolant is on at the machine, for the modes of the next typed line.
struct MachineOutputs {
  double rpm = 0;          ///< as programmed; + clockwise
  int coolant = 0;         ///< bits: 1 mist, 2 flood
  bool rpm_known = false;  ///< false: the override is at 0, and whether it was switched off is not to be seen
  bool broken_off = false;  ///< since the last program began, a stop has switched everything off
  bool operator==(const MachineOutputs&) const = default;
};

/// The modes in which a typed line begins, `kept` being those that the line before has left: with what is on.
/// A stop, a fault or an emergency stop switches off what a line has switched on, and a program that fails
/// leaves on what it has. Nothing is kept where nothing is on and no line came before.
void adopt_outputs(const MachineOutputs& outputs, const Assembly& assembly, const Parameters& parameters,
                   const ToolTable& tools, std::optional<Settings>& kept);

}  // namespace trn

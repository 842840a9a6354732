#pragma once

#include <atomic>

#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "app/session/plan_time.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"

namespace trn {

/// How long a whole program takes.
struct ProgramTime {
  PlanTime time;
  bool known = false;  ///< false: it goes on for very long, or cannot be planned to its end
  bool about = false;  ///< the program asks the machine (M66, G38), and the answer was guessed
};

/// Plans a whole program and throws the plan away. Parameters and tools are copies; nothing is written, and
/// nothing is said. Counted: motion and dwells; not: whatever waits, as for a tool, the spindle or a person.
/// A tool that is asked for counts as put in; a probe move meets its work where it is programmed to end, and
/// an input is 0. One round of a program that goes round by M99. `given_up` ends it; then it is not known.
ProgramTime time_program(const Assembly& assembly, Parameters parameters, ToolTable tools, ProgramStart start,
                         const std::atomic<bool>* given_up = nullptr);

}  // namespace trn

#pragma once

#include <atomic>

#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "app/session/plan_time.h"
#include "app/session/program_step.h"
#include "core/motion.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/joint_map.h"
#include "kernel/motion_queue.h"

namespace trn {

/// How long a whole program takes.
struct ProgramTime {
  PlanTime time;
  bool known = false;  ///< false: it goes on for very long, or cannot be planned to its end
  bool about = false;  ///< the program asks the machine (M66, G38), and the answer was guessed
};

/// What the machine would say to a program that asks it, as far as nobody can know it: the tool is in, a
/// probe meets its work where the move was programmed to end, an input is 0. `last`: the last block with
/// motion.
ProgramAnswer guessed_answer(const QueueEvent& event, const MachineJointMap& map, const MotionBlock& last);

/// Plans a whole program and throws the plan away. Parameters and tools are copies; nothing is written, and
/// nothing is said. Counted: motion and dwells; not: whatever waits, as for a tool, the spindle or a person.
/// What the program asks is guessed (`guessed_answer`). One round of a program that goes round by M99.
/// `given_up` ends it; then it is not known.
ProgramTime time_program(const Assembly& assembly, Parameters parameters, ToolTable tools, ProgramStart start,
                         const std::atomic<bool>* given_up = nullptr);

}  // namespace trn

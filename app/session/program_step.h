#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "app/session/assembly.h"
#include "app/session/plan_time.h"
#include "core/axes.h"
#include "core/motion.h"
#include "core/ports.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/g_code.h"
#include "interp/gcode/interpreter.h"
#include "interp/gcode/lowering.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/settings.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"
#include "kernel/joint_map.h"

namespace trn {

/// What a person wants to know of one step of a program, a move or an event between moves. Plain data, for
/// it goes from the process that plans programs to the one that shows them.
struct ProgramStep {
  SourceLine source;
  std::uint64_t block = 0;      ///< how many blocks were run, with its own: tells the passes of a line apart
  bool moves = false;           ///< to `to`; else an event
  bool rapid = false;           ///< G0
  bool arc = false;             ///< G2, G3, a helix
  Words to = Words::Zero();     ///< as in ProgramMove
  double length_mm = 0;         ///< tip_length_mm
  PlanTime begins_at;           ///< of the program, up to where its first block begins
  PlanTime::Kind timing;        ///< of that block
  MapContext context;           ///< what such words mean to the joints
  ProgramFrame frame;           ///< and to the program
  Settings settings;            ///< behind its line
  GCode cutter_comp = 40_g;     ///< G40, G41 or G42
  double tool_radius_mm = 0;    ///< of the tool in the spindle, by the table
  std::array<char, 96> text{};  ///< its line (ParsedBlock::text); "" where that is not known any more
  std::array<char, 64> file{};  ///< the end of its file's path
};

/// The step that an interpreter is at. `move`: that it has just handed out; null: an event.
ProgramStep step_of(const Interpreter& interpreter, const Lowering& lowering, const ToolTable& tools,
                    SourceLine source, const ProgramMove* move);

/// Between programs: modes, offsets and tool with which the next one begins. `kept`: the modes of the MDI
/// lines before; null: the config's.
ProgramStep idle_step(const Assembly& assembly, Parameters parameters, ToolTable tools, const Settings* kept);

/// Where the machine is, in the ways in which people count; mm and degrees.
struct ShownPosition {
  MmWords work;          ///< in the program's coordinate system: the tip with its tool, as X Y Z A B C words
  MachineWords machine;  ///< as G53 counts: the axes without offsets
  MmWords to_go;         ///< from `work` to the end of the move; zero if there is none
};
/// `q`: plan's joints; `on_path`, `y`: as in CycleReport, for a motion of this step. Zero where a position
/// has no axis words.
ShownPosition shown_position(const MachineJointMap& map, const ProgramStep& step, const JointVec& q,
                             bool on_path, const Words& y);

/// How long the way of the tip is, mm, also along an arc or helix.
double tip_length_mm(const ProgramMove& move);

/// The words of a context (with RTCP: the tip in the table frame) whose joints are q.
KinStatus words_in(const MachineJointMap& map, const JointVec& q, const MapContext& context, Words& words);

}  // namespace trn

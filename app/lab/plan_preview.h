#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "core/axes.h"
#include "core/frames.h"
#include "core/machine.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"

namespace trn {

/// A place of the planned motion, and what happened on the way there from the place before: the greatest
/// values.
struct PlanPoint {
  Vec3 p_B = Vec3::Zero();  ///< tip in the table frame, mm
  double time_s = 0;        ///< since the program's start, dwells included
  double speed_mm_s = 0;    ///< of the tip in the table frame
  double feed_mm_s = 0;     ///< that the program asks for; 0: a rapid, or no speed of the tip
  std::uint32_t line = 0;   ///< of the program's text, counted from 1
  float velocity = 0, acceleration = 0,
        jerk = 0;  ///< of the joint that is nearest to a limit, over the limit
  int joint = -1;  ///< this joint; -1: none comes near a limit, the feed decides
  bool rapid = false;
  bool jump = false;  ///< no way leads here: another tool length, or tip control, moves the tip on paper only
  float deviation_mm = 0;  ///< of the tip from the programmed path
  float significance = 0;  ///< mm; a picture that is coarser than this may leave the point out
};

/// A program's motion as it will be, without drives: where the tip goes, how fast, and what limits it.
struct PlanPreview {
  std::vector<PlanPoint> points;
  JointVec q_min, q_max;      ///< that the joints go through, mm or rad
  std::array<Vec3, 2> box_B;  ///< of the cuts; of all where there is none
  double time_s = 0, cut_mm = 0, rapid_mm = 0;
  std::vector<double> limited_s;  ///< how long each joint is the one that limits
  double free_s = 0;              ///< how long none does
  std::uint64_t blocks = 0;
  std::string message;             ///< why it ends before the program does; "" if it does not
  std::uint32_t message_line = 0;  ///< the line it is about; 0: none
};

struct PreviewOptions {
  std::size_t points_max = 400000;  ///< of the result; the picture becomes coarser rather than longer
  double time_max_s = 24 * 3600.0;  ///< of motion; a program may go round for ever
};

/// Plans the program from `start`. What the machine would answer is guessed: every tool is in, inputs read 0,
/// and a probe touches nothing. Parameters and tools are changed as by a run.
PlanPreview preview_plan(const Assembly& assembly, Parameters& parameters, ToolTable& tools,
                         const ProgramStart& start, const PreviewOptions& options);

/// As the operator's page reads it: docs/panel.md, "The plan".
void write_plan(const std::string& path, const PlanPreview& preview, const Machine& machine,
                const std::string& program);

/// Sets `significance` of each point: how far the picture is off without it, in space and, as a colour shows
/// it, in speed. The ends of every piece of `piece` points have an infinite one.
void rate_points(std::vector<PlanPoint>& points, double mm_per_mm_s, std::size_t piece);

}  // namespace trn

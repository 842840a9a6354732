#pragma once

#include <cstdlib>

#include "core/axes.h"
#include "interp/move.h"
#include "interp/plan/speed/speed_options.h"
#include "interp/plan/speed/speed_planner.h"
#include "interp/plan/stages.h"
#include "tests/interp/plan/geometry_check.h"
#include "tests/interp/plan/speed_support.h"

// Programmed moves through both stages of the planner, on a five-axis machine whose joints are the words.
namespace trn::speed_test {

inline Joints five_joints() {
  Joints joints = linear_joints(3);
  const double d = kRadPerDeg;
  for (const char* name : {"A", "C"})
    joints.push_back(joint(name, JointKind::kRotary, 36000 * d, 240 * d, 1500 * d, 30000 * d));
  return joints;
}

struct DrivenProgram {
  std::vector<PlanPiece> pieces;
  SpeedStats stats;
  Verdict verdict;  ///< only if asked for
};

inline DrivenProgram drive_program(const std::vector<ProgramMove>& moves, bool judged = false) {
  const IdentityMap map({kX, kY, kZ, kA, kC});
  const Joints joints = five_joints();
  Collector out;
  SpeedPlanner speed(joints, map, {}, out);
  DrivenProgram driven{geometry_check::plan(moves), {}, {}};
  for (const PlanPiece& piece : driven.pieces) speed.piece(piece);
  speed.finish();
  driven.stats = speed.stats();
  if (judged) driven.verdict = judge(out.blocks, map, joints, 2.5e-4);
  return driven;
}

}  // namespace trn::speed_test

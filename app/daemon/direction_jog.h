#pragma once

#include <string>

#include "app/session/program_step.h"
#include "core/axes.h"
#include "core/ports.h"
#include "kernel/joint_map.h"

namespace trn {

/// Along what a jog goes that the plan, and not a single joint, makes.
enum class JogFrame { kMachine, kWork, kTool };

/// As the operator asks for it.
struct DirectionWish {
  JogFrame frame = JogFrame::kMachine;
  int word = kX;           ///< kX to kC: the frame's axis; of work and tool X, Y and Z only
  double way = 0;          ///< mm or rad, signed
  double speed = 0;        ///< per s; 0: by speed_share
  double speed_share = 0;  ///< of the speed at which the first joint comes to its limit, 0 to 1; 0: a tenth
  bool held = false;       ///< goes on until it is let go or at a limit; only the sign of `way` counts
};

/// The same as lines of G-code that change no mode; or why it cannot be.
struct DirectionOrder {
  std::string program;
  std::string remark;   ///< what was cut short, for people; "" if nothing
  std::string refusal;  ///< then nothing shall move
};

/// What plans it: the machine's map, its mechanism, the joints with the limits that hold, and the modes and
/// offsets between programs.
struct DirectionParts {
  const MachineJointMap& map;
  const Kinematics& kinematics;
  const Joints& joints;
  const ProgramStep& step;
};

/// From joints q (mm, rad). The axes of `kTool` are those of the spindle: Z points from the tip to the
/// spindle. Those of `kWork` are the program's, with its rotation and its tilted plane. The rotary axes
/// stand, except where one of them is jogged along `kMachine`.
DirectionOrder plan_direction_jog(const DirectionWish& wish, const DirectionParts& parts, const JointVec& q);

}  // namespace trn

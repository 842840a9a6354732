#pragma once

#include <string>
#include <vector>

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
  double way = 0;       ///< as far as the joints can go, mm or rad, signed
  double speed = 0;     ///< per s
};

/// One joint's part of a straight stretch; joint as in RtCommand::Kind::kJog.
struct JogStretch {
  int joint = 0;
  double way = 0, speed = 0;
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

/// The same while a program is held, by jogs of the joints that begin and end together: the first stretch of
/// such an order from q, and of its `way` so much as leaves the line by less than kStretchOff_mm. `part` is
/// that much. Empty: the machine stands where there is none.
std::vector<JogStretch> plan_stretch(const DirectionWish& wish, const DirectionParts& parts,
                                     const JointVec& q, double way, double speed, double& part);
inline constexpr double kStretchOff_mm = 0.05, kStretchOff_rad = 5e-4;  ///< of each joint

}  // namespace trn

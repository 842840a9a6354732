#pragma once

#include <optional>
#include <string>

#include "core/axes.h"
#include "core/ports.h"

namespace trn {

/// The one motor joint that moves for an axis word, and which way: joint = sense * word.
struct WordJoint {
  int joint = 0;
  double sense = 1;
};
/// None if the machine does not obey the word (kX to kC), or several joints move for it.
std::optional<WordJoint> joint_of_word(const Kinematics& kinematics, int word);

/// A jog as the operator asks for it; mm or rad.
struct JogWish {
  std::string word;  ///< axis word in whose direction `way` counts; "": `joint`, in its own direction
  int joint = 0;
  double way = 0;          ///< 0: the joint stops
  double speed = 0;        ///< per s; 0: by speed_share
  double speed_share = 0;  ///< of the joint's velocity limit, 0 to 1; 0: the tick's own choice
  bool held = false;       ///< goes on until it is let go or at its limit; only the sign of `way` counts
  bool moves = false;      ///< a jog is under way, which this one continues
};

/// The same in motor joints, within the limits; or why it cannot be.
struct JogOrder {
  int joint = 0;
  double way = 0, speed = 0;
  std::string remark;   ///< what was cut short, for people; "" if nothing
  std::string refusal;  ///< then nothing shall move
};

/// `joints` with the limits that the tick keeps, which stand at q; `kinematics` may be null: no words.
JogOrder plan_jog(const JogWish& wish, const Kinematics* kinematics, const Joints& joints, const JointVec& q);

}  // namespace trn

#pragma once

#include <string>
#include <vector>

#include "core/axes.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/ports.h"

namespace trn {

/// What a small positive program word does, from where the machine stands.
struct WordDirection {
  int word = kX;
  bool known = false;  ///< false: the machine cannot go there
  JointVec joints;     ///< way of each joint, per mm or rad of the word
  Vec3 tip =
      Vec3::Zero();  ///< way of the gauge point, seen from the work, in the axes of a program; per mm or rad
  Vec3 turn = Vec3::Zero();  ///< turn of the tool seen from the work, the same; rad per mm or rad
  /// ISO 841: a positive linear word moves the tool towards + of its axis, a positive rotary word turns it
  /// right-handed about its axis, both seen from the work.
  bool as_iso_841() const;
};

/// One for each word that the machine obeys, with all words at `from`.
std::vector<WordDirection> word_directions(const Kinematics& kinematics, const Words& from);

/// "the tool goes towards +X of the work" and which joints move, for people.
std::string describe(const WordDirection& direction, const Machine& machine);

}  // namespace trn

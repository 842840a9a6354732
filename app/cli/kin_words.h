#pragma once

#include <string>

#include "core/axes.h"
#include "core/machine.h"
#include "core/ports.h"

namespace trn {

/// Kinematics in the words of a machinist: program words and named joints, mm and degrees.
class KinWords {
 public:
  KinWords(const Machine& machine, const Kinematics& kinematics);

  // What a line leaves out is 0, or, on a platform that cannot stand with every word at 0, as at its home.

  /// "X=10 C=90" (joints) to words and tip; std::invalid_argument with what is legal.
  std::string forward(const std::string& line) const;
  /// "X10 A30" (words) to joints and tip; the same error.
  std::string inverse(const std::string& line) const;
  /// What every positive word does from there, a line each.
  std::string directions() const;

 private:
  std::string tip_text(const JointVec& q) const;

  const Machine& machine_;
  const Kinematics& kinematics_;
  Words rest_ = Words::Zero();
};

}  // namespace trn

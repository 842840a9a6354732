#pragma once

#include <string>

#include "core/axes.h"
#include "core/machine.h"
#include "core/ports.h"

namespace trn {

/// Kinematics in the words of a machinist: program words and named joints, mm and degrees.
class KinWords {
 public:
  KinWords(const Machine& machine, const Kinematics& kinematics)
      : machine_(machine), kinematics_(kinematics) {}

  /// "X=10 C=90" (joints; what is missing is 0) to words and tip; std::invalid_argument with what is legal.
  std::string forward(const std::string& line) const;
  /// "X10 A30" (words; what is missing is 0) to joints and tip.
  std::string inverse(const std::string& line) const;
  /// What every positive word does, a line each.
  std::string directions() const;

 private:
  std::string tip_text(const JointVec& q) const;

  const Machine& machine_;
  const Kinematics& kinematics_;
};

}  // namespace trn

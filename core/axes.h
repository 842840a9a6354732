#pragma once

#include <Eigen/Dense>
#include <string>
#include <vector>

namespace trn {

/// The most motor joints a machine may have.
inline constexpr int kMaxJoints = 9;

/// One value per motor joint (mm or rad), sized to the machine, stored in place (never allocates).
using JointVec = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxJoints, 1>;

/// The six program words X Y Z (mm) and A B C (rad), in this order. A machine obeys those it has.
using Words = Eigen::Matrix<double, 6, 1>;
enum WordIndex { kX = 0, kY, kZ, kA, kB, kC };
inline constexpr char kWordLetters[] = "XYZABC";

enum class JointKind { kLinear, kRotary };

/// Limits of one motor joint; mm or rad and s. All symmetric but the position.
struct JointLimit {
  double min = 0, max = 0;
  double velocity = 0, acceleration = 0, jerk = 0;
};

struct Joint {
  std::string name;  ///< as in the trace header, e.g. "X", "A", "leg1"
  JointKind kind = JointKind::kLinear;
  JointLimit limit;
  bool endless = false;  ///< a rotary joint that turns as far as one likes
};

using Joints = std::vector<Joint>;

}  // namespace trn

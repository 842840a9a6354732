#pragma once

#include <array>

#include "core/frames.h"
#include "core/ports.h"

namespace trn {

/// The turning axes of a machine, from the table to the tool, and the closed-form answer to: which angles
/// point the tool along u? Zero, one or two axes of any direction (the second not along the tool, the two not
/// parallel), and a tool z of any direction, (0, 0, 1) unless the head is tilted. Two axes: E1 E2 z = u gives
/// w1.E2 z = w1.u, an equation a cos + b sin = d for the second angle
/// with two solutions, then a plain angle for the first. Source: Paden-Kahan subproblems 1 and 2.
class RotaryAxes {
 public:
  static constexpr int kMax = 2;
  using Angles = std::array<double, kMax>;

  /// All solutions, each unwrapped to the turn nearest to the seed; at a pole the free angle is the seed's.
  struct Solutions {
    std::array<Angles, 2> angles{};
    int count = 0;  ///< 0: u is out of reach
  };

  /// `tool`: the tool's axis with every angle at zero, a unit vector.
  explicit RotaryAxes(const Vec3& tool = Vec3::UnitZ()) : tool_(tool) {}

  /// False if there is no closed form for these axes.
  bool add_axis(const Vec3& axis);
  int count() const TRN_RT { return count_; }

  Solutions solve(const Vec3& u, const Angles& seed) const TRN_RT;

 private:
  Solutions solve_none(const Vec3& u) const TRN_RT;
  Solutions solve_one(const Vec3& u, const Angles& seed) const TRN_RT;
  Solutions solve_two(const Vec3& u, const Angles& seed) const TRN_RT;

  Vec3 tool_;
  std::array<Vec3, kMax> axis_;
  int count_ = 0;
  // Two axes: w1.E2 z = mean + amplitude cos(angle - phase); gap_up = mean + amplitude - 1 and gap_down =
  // amplitude - mean - 1 are 0 where the tool can lie along +-w1, that is, where there is a pole.
  double mean_ = 0, amplitude_ = 0, phase_ = 0, gap_up_ = 0, gap_down_ = 0;
};

/// Squared distance of two sets of angles.
inline double distance2(const RotaryAxes::Angles& a, const RotaryAxes::Angles& b) TRN_RT {
  return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
}

}  // namespace trn

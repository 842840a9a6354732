#include "kinematics/serial/rotary_axes.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/units.h"
#include "kinematics/serial/chain.h"

namespace trn {

namespace {

// Angles and sines below this are rounding: an axis nearer to a pole keeps its free angle (the tool axis is
// then wrong by no more than this), a direction this far beyond reach is in reach.
constexpr double kRounding = 5e-13;
// Two axes whose directions differ by less than this turn the tool in one plane only, and the closed form
// would divide by nearly nothing.
constexpr double kParallel = 1e-6;
constexpr double kTurnsMax = 1e6;  // a seed further off than this is no seed

double unwrapped(double angle, double seed) TRN_RT {
  // A rotary axis may stand at 3605 degrees after ten turns. The answer goes on from there, at 3600 and some,
  // instead of winding all turns back.
  const double turns = std::round((seed - angle) / (2 * kPi));
  return std::abs(turns) < kTurnsMax ? angle + 2 * kPi * turns : angle;
}

/// Angle about the unit vector `axis` that turns v into u (both at the same angle to the axis).
double angle_between(const Vec3& axis, const Vec3& v, const Vec3& u) TRN_RT {
  // What is left across the axis turns in a plane, and the angle there needs no division: two vectors along
  // the axis give atan2(0, 0) = 0.
  const Vec3 v_flat = v - axis.dot(v) * axis, u_flat = u - axis.dot(u) * axis;
  return std::atan2(axis.dot(v_flat.cross(u_flat)), v_flat.dot(u_flat));
}

// An A/C table has gaps of exactly 0 that come out as 1e-16. Such a rest would let the pole lie just out of
// reach.
double snapped(double value) { return std::abs(value) < kRounding ? 0.0 : value; }

}  // namespace

bool RotaryAxes::add_axis(const Vec3& axis) {
  TRN_CHECK(std::abs(axis.norm() - 1) < 1e-9);
  if (count_ == kMax) return false;
  axis_[count_++] = axis;
  if (count_ < 2) return true;
  const Vec3& z = tool_;
  const Vec3 &w1 = axis_[0], &w2 = axis_[1];
  if (w1.cross(w2).norm() < kParallel || w2.cross(z).norm() < kParallel) return false;
  // By Rodrigues' formula E2 z = (w2.z) w2 + cos (z - (w2.z) w2) + sin (w2 x z). Its part along w1 is what
  // the first axis cannot change, and w1.(w2 x z) is the sine's factor.
  const double a = w1.dot(z - w2.dot(z) * w2), b = w1.dot(w2.cross(z));
  mean_ = w1.dot(w2) * w2.dot(z);
  amplitude_ = std::hypot(a, b);
  phase_ = std::atan2(b, a);
  gap_up_ = snapped(amplitude_ + mean_ - 1.0);
  gap_down_ = snapped(amplitude_ - mean_ - 1.0);
  return true;
}

RotaryAxes::Solutions RotaryAxes::solve(const Vec3& u, const Angles& seed) const TRN_RT {
  if (count_ == 0) return solve_none(u);
  return count_ == 1 ? solve_one(u, seed) : solve_two(u, seed);
}

RotaryAxes::Solutions RotaryAxes::solve_none(const Vec3& u) const TRN_RT {
  Solutions out;
  out.count = (u - tool_).norm() < 2 * kRounding ? 1 : 0;
  return out;
}

RotaryAxes::Solutions RotaryAxes::solve_one(const Vec3& u, const Angles& seed) const TRN_RT {
  const Vec3& z = tool_;
  const Vec3& w = axis_[0];
  Solutions out;
  const bool free = w.cross(z).norm() < kRounding;
  const double angle = free ? seed[0] : unwrapped(angle_between(w, z, u), seed[0]);
  const bool reached = (rotation_about(w, angle) * z - u).norm() < 2 * kRounding;
  out.angles[0] = {angle, 0.0};
  out.count = reached ? 1 : 0;
  return out;
}

RotaryAxes::Solutions RotaryAxes::solve_two(const Vec3& u, const Angles& seed) const TRN_RT {
  // 1 -+ w1.u as half a squared distance, which keeps all digits near the pole where the cosine loses them.
  const Vec3 &w1 = axis_[0], &w2 = axis_[1];
  const double upper = gap_up_ + 0.5 * (u - w1).squaredNorm();
  const double lower = gap_down_ + 0.5 * (u + w1).squaredNorm();
  // No turn of the second axis gives u that angle to the first: a head whose A axis is inclined by 45 degrees
  // cannot tilt the tool beyond the horizontal.
  if (upper < -kRounding || lower < -kRounding) return {};
  // The equation is amplitude cos(x) = w1.u - mean, and upper and lower are amplitude -+ that. Their product
  // is (amplitude sin x)^2. The arc tangent of both keeps the digits that the arc cosine loses near its ends.
  const double sine = std::sqrt(std::max(upper, 0.0) * std::max(lower, 0.0));
  const double half_angle = std::atan2(sine, 0.5 * (lower - upper));
  // With the tool along the first axis that axis may stand anywhere. Its angle stays where it is, instead of
  // leaping to what the rounding of u says.
  const bool pole = w1.cross(u).squaredNorm() < kRounding * kRounding;
  Solutions out;
  for (const double sign : {1.0, -1.0}) {
    const double second = unwrapped(phase_ + sign * half_angle, seed[1]);
    const Vec3 v = rotation_about(w2, second) * tool_;
    const double first = pole ? seed[0] : unwrapped(angle_between(w1, v, u), seed[0]);
    out.angles[out.count++] = {first, second};
  }
  return out;
}

}  // namespace trn

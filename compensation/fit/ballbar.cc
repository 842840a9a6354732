#include "compensation/fit/ballbar.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/units.h"

namespace trn {

namespace {

// The lengths of docs/sources.md S1.6 and S1.7, mm.
constexpr double kRadius = 100, kBar = 100, kLongBar = 150, kHeight = 75;
constexpr double kDistanceA = 550, kDistanceC = 78;

int work_axis_along(const ActualChain& chain, const Vec3& direction) {
  for (const ActualAxis& axis : chain.work)
    if (axis.joint >= 0 && axis.kind == JointKind::kRotary && axis.direction.cross(direction).norm() < 1e-9)
      return axis.joint;
  throw std::invalid_argument(
      "the ball-bar tests need a table that turns about an axis parallel to X and one parallel to Z");
}

}  // namespace

double BallbarTrace::peak_to_peak_mm() const {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const BallbarReading& r : readings) {
    low = std::min(low, r.reading_mm);
    high = std::max(high, r.reading_mm);
  }
  return readings.empty() ? 0 : high - low;
}

std::vector<BallbarTest> ballbar_tests(const ActualChain& chain) {
  const int A = work_axis_along(chain, Vec3::UnitX()), C = work_axis_along(chain, Vec3::UnitZ());
  // With the cup moved along the axis by this much, the longer bar reaches the same circle, now as a cone. A
  // tilt of the axis then shows in the reading to first order; in the plane test it does not.
  const double extension = std::sqrt(kLongBar * kLongBar - kRadius * kRadius), H = kHeight;
  const auto a = [&](const char* name, const Vec3& ball, const Vec3& cup, double bar) {
    // The cradle cannot turn all the way round: 110 degrees about A give 441 readings of a quarter degree,
    // and C gives 721.
    return BallbarTest{name, A, ball, cup, bar, -100 * kRadPerDeg, 10 * kRadPerDeg, 0, 0.25 * kRadPerDeg};
  };
  const auto c = [&](const char* name, const Vec3& ball, const Vec3& cup, double bar) {
    return BallbarTest{name, C, ball, cup, bar, 0, 2 * kPi, kPi / 4, 0.5 * kRadPerDeg};
  };
  // Two circles of the same axis, half the distance to either side of the middle, for the planar method.
  const double da = kDistanceA / 2, dc = kDistanceC / 2;
  return {a("a", {0, kRadius, H}, {0, 0, 0}, kBar),
          a("a_extended", {0, kRadius, H}, {extension, 0, 0}, kLongBar),
          c("c", {kRadius, 0, H}, {0, 0, 0}, kBar),
          c("c_extended", {kRadius, 0, H}, {0, 0, extension}, kLongBar),
          a("a_left", {-da, kRadius, H}, {-da, 0, 0}, kBar),
          a("a_right", {da, kRadius, H}, {da, 0, 0}, kBar),
          c("c_low", {kRadius, 0, H - dc}, {0, 0, -dc}, kBar),
          c("c_high", {kRadius, 0, H + dc}, {0, 0, dc}, kBar)};
}

double ballbar_reading(const ActualChain& chain, const BallbarTest& test, const BallbarSetup& setup,
                       const JointVec& q) {
  ActualChain::Frames f;
  chain.evaluate(q, f);
  const Vec3 ball = f.X_MB.p + f.X_MB.A * (test.ball_B + setup.ball_offset_B);
  return (ball - (f.X_MS.p + setup.cup_offset_M)).norm() - test.bar_mm;
}

JointVec ballbar_joints(const ActualChain& chain, const BallbarTest& test, double angle_rad) {
  int count = 0;
  for (const auto* branch : {&chain.tool, &chain.work})
    for (const ActualAxis& axis : *branch) count += axis.joint >= 0 ? 1 : 0;
  JointVec q = JointVec::Zero(count);
  Vec3 start = Vec3::Zero();
  for (const ActualAxis& axis : chain.tool) start += axis.offset_mm;
  // The linear axes are square to each other in the nominal chain, so each has its own part of the way to the
  // cup.
  for (const ActualAxis& axis : chain.tool)
    if (axis.joint >= 0 && axis.kind == JointKind::kLinear)
      q[axis.joint] = axis.direction.dot(test.cup_M - start);
  q[test.joint] = angle_rad;
  return q;
}

}  // namespace trn

#include "interp/plan/speed/joint_curve.h"

#include <gtest/gtest.h>

#include <complex>

#include "core/axes.h"
#include "core/motion.h"
#include "core/path.h"
#include "core/ports.h"
#include "interp/plan/speed/joint_derivatives.h"
#include "interp/plan/speed/path_sampler.h"
#include "interp/plan/speed/time_law.h"
#include "interp/plan/stages.h"
#include "tests/interp/plan/speed_support.h"

namespace trn::speed_test {
namespace {

using speed::JointCurve;
using speed::JointDerivatives;
using speed::JointPanel;
using speed::PathSampler;

/// A line of the tip on a table that turns about Z with it, A at rest: X + iY of the joints is
/// (p0 + p1 s) exp(i (c0 + w s)).
struct TurningLine {
  std::complex<double> p0{40, -25}, p1{0.6, 0.3};
  double c0 = 0.4, w = 0.006;

  PlanPiece piece(double length) const {
    Words from = Words::Zero(), to = Words::Zero();
    const std::complex<double> end = p0 + length * p1;
    from << p0.real(), p0.imag(), 10, 0, 0, c0;
    to << end.real(), end.imag(), 10, 0, 0, c0 + w * length;
    PathPiece line = make_line(from, to);
    line.c[1] = (to - from) / length;  // by the s of the formula
    line.length = length;
    return plan(line, 100);
  }
  std::array<std::complex<double>, 4> derivatives(double s) const {
    const std::complex<double> i(0, 1), p = p0 + s * p1, e = std::exp(i * (c0 + w * s));
    return {p * e, (p1 + i * w * p) * e, (2.0 * i * w * p1 - w * w * p) * e,
            (-3 * w * w * p1 - i * w * w * w * p) * e};
  }
};

TEST(JointCurve, TellsDerivativesOfAClosedForm) {
  const TrunnionMap map;
  const TurningLine line;
  for (const double length : {0.1, 1.0, 10.0, 40.0}) {
    SCOPED_TRACE(length);
    JointPanel panel;
    ASSERT_TRUE(panel.interpolate(map, line.piece(length), 0, length));
    for (double u = 0; u <= 1; u += 1.0 / 16) {
      const auto truth = line.derivatives(u * length);
      JointDerivatives d;
      panel.at(u * length, d);
      const double rounding = 2e-13, by = 1 / length;
      EXPECT_NEAR(d.q[0], truth[0].real(), 10 * rounding);
      EXPECT_NEAR(d.d1[1], truth[1].imag(), 100 * rounding * by);
      EXPECT_NEAR(d.d2[0], truth[2].real(), panel.error2()[0] + 1e3 * rounding * by * by);
      EXPECT_NEAR(d.d3[0], truth[3].real(), panel.error3()[0] + 3e4 * rounding * by * by * by);
      EXPECT_NEAR(d.d3[1], truth[3].imag(), panel.error3()[1] + 3e4 * rounding * by * by * by);
      EXPECT_EQ(d.d1[3], 0) << "A stands still";
    }
  }
}

/// The tip's X with a kink every 3 mm, as a table of linear pieces would leave it.
class KinkedMap : public JointMap {
 public:
  int joint_count() const TRN_RT override { return 1; }
  KinStatus map(const Words& y, const MapContext&, JointVec& q) const TRN_RT override {
    q.resize(1);
    q[0] = y[kX] + 0.01 * std::abs(std::remainder(y[kX], 6.0));
    return KinStatus::kOk;
  }
};

TEST(JointCurve, LeavesOutWhatNoPolynomialTells) {
  const KinkedMap map;
  const Joints joints = linear_joints(1);
  const PathSampler sampler(joints, map, speed::joint_rates(joints, 1, 1));
  Words from = Words::Zero(), to = Words::Zero();
  from[kX] = 0.1;
  to[kX] = 8.1;
  JointCurve curve;
  sampler.curve(plan(make_line(from, to), 100), curve);
  ASSERT_FALSE(curve.empty()) << "between the kinks a line is a line";
  for (const double kink : {3.0, 6.0}) EXPECT_EQ(speed::panel_at(curve, kink - 0.1), nullptr);
  double covered = 0;
  for (const JointPanel& panel : curve) covered += panel.s1() - panel.s0();
  EXPECT_GE(covered, 3.0);
}

// Five axes between two random states, 1.5 long.
PlanPiece random_piece(std::mt19937_64& rng) {
  std::uniform_real_distribution<double> u(-1, 1);
  PathPoint ends[2];
  for (PathPoint& end : ends)
    for (Words* w : {&end.y, &end.d1, &end.d2, &end.d3})
      for (int k = 0; k < 6; ++k) (*w)[k] = u(rng) * (k < 3 ? 1 : 0.017) * (w == &end.y ? 1 : 0.3);
  return plan(make_hermite(ends[0], ends[1], 1.5), 100);
}

TEST(JointCurve, TheSamplerAgreesWithTheMapItself) {
  const TrunnionMap map;
  const Joints joints = cradle_joints();
  const PathSampler sampler(joints, map, speed::joint_rates(joints, 1, 1));
  std::mt19937_64 rng(7);
  for (int i = 0; i < 200; ++i) {
    const PlanPiece piece = random_piece(rng);
    JointCurve curve;
    sampler.curve(piece, curve);
    for (const double s : {0.0, 0.4, 1.1, 1.5}) {
      const speed::PathSample predicted = sampler.sample(piece, curve, s, s, 0),
                              asked = sampler.sample(piece, {}, s, s, 0);
      const double b = std::min(sampler.bound(asked).b, sampler.bound(predicted).b);
      for (size_t j = 0; j < 5; ++j) {
        const JointLimit& limit = joints[j].limit;
        EXPECT_LT(std::abs(predicted.d2[j] - asked.d2[j]) * b, 2e-3 * limit.acceleration)
            << i << " joint " << j;
        EXPECT_LT(std::abs(predicted.d3[j] - asked.d3[j]) * b * std::sqrt(b), 2e-3 * limit.jerk)
            << i << " joint " << j;
      }
    }
  }
}

// Where the bound says so, the parabola through three samples is as close as it says; and for short steps it
// does say so.
TEST(JointCurve, ParabolasTellWhereTheBoundSaysSo) {
  const TrunnionMap map;
  const Joints joints = cradle_joints();
  const PathSampler sampler(joints, map, speed::joint_rates(joints, 1, 1));
  std::mt19937_64 rng(11);
  int predicted = 0, not_predicted = 0;
  for (int i = 0; i < 200; ++i) {
    const PlanPiece piece = random_piece(rng);
    JointCurve curve;
    sampler.curve(piece, curve);
    const double b = sampler.bound(sampler.sample(piece, curve, 0.75, 0.75, 0)).b;
    for (const double step : {0.02, 0.1, 0.3}) {
      for (double s0 = 0; s0 + 2 * step <= 1.5; s0 += 2 * step) {
        const double share = 1e-3;
        const bool says = sampler.parabolas_predict(piece, curve, s0, s0 + 2 * step, step, b, share);
        (says ? predicted : not_predicted) += 1;
        if (!says) continue;
        speed::PathSample three[3];
        for (int k = 0; k < 3; ++k) three[k] = sampler.sample(piece, curve, s0 + k * step, s0 + k * step, 0);
        for (const double s : {s0 + step / 2, s0 + 3 * step / 2}) {
          const speed::PathSample truth = sampler.sample(piece, curve, s, s, 0),
                                  parabola = speed::interpolate(three, s, 5);
          for (size_t j = 0; j < 5; ++j) {
            const JointLimit& limit = joints[j].limit;
            EXPECT_LE(std::abs(truth.d2[j] - parabola.d2[j]) * b, 1.001 * share * limit.acceleration) << i;
            EXPECT_LE(std::abs(truth.d3[j] - parabola.d3[j]) * b * std::sqrt(b), 1.001 * share * limit.jerk)
                << i;
          }
        }
      }
    }
  }
  EXPECT_GT(predicted, 1000);
  EXPECT_GT(not_predicted, 100);
}

}  // namespace
}  // namespace trn::speed_test

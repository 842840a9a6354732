#include "interp/plan/speed/joint_derivatives.h"

#include <gtest/gtest.h>

#include "core/axes.h"
#include "core/motion.h"
#include "core/path.h"
#include "core/ports.h"
#include "interp/move.h"
#include "interp/plan/speed/joint_rates.h"
#include "interp/plan/stages.h"
#include "tests/interp/plan/speed_support.h"

namespace trn::speed_test {
namespace {

/// q = exp(x / 50), and fails beyond x = 20.
class ExponentialMap : public JointMap {
 public:
  int joint_count() const TRN_RT override { return 1; }
  KinStatus map(const Words& y, const MapContext&, JointVec& q) const TRN_RT override {
    q.resize(1);
    q[0] = std::exp(y[kX] / 50);
    return y[kX] > 20 ? KinStatus::kUnreachable : KinStatus::kOk;
  }
};

PlanPiece line_to(double x) {
  Words to = Words::Zero();
  to[kX] = x;
  return plan(make_line(Words::Zero(), to), 100);
}

TEST(JointDerivatives, AreThoseOfTheClosedForm) {
  speed::JointDerivatives d;
  for (const double s : {0.0, 3.0, 10.0}) {
    ASSERT_EQ(speed::joint_derivatives(ExponentialMap(), line_to(10), s, d), KinStatus::kOk);
    const double q = std::exp(s / 50);
    EXPECT_NEAR(d.q[0], q, 1e-15);
    EXPECT_NEAR(d.d1[0], q / 50, 1e-13);
    EXPECT_NEAR(d.d2[0], q / 2500, 2e-11);
    EXPECT_NEAR(d.d3[0], q / 125000, 2e-9);
  }
}

TEST(JointDerivatives, FailWhereTheMapFails) {
  speed::JointDerivatives d;
  EXPECT_EQ(speed::joint_derivatives(ExponentialMap(), line_to(30), 25, d), KinStatus::kUnreachable);
}

TEST(JointDerivatives, FeedSpeedKeepsTipAndRotaryFeed) {
  Words to = Words::Zero();
  to[kX] = 3;
  to[kZ] = 4;
  to[kA] = 0.2;
  PlanPiece piece = plan(make_line(Words::Zero(), to), 50);
  const double units = piece.piece.length;  // path units for 5 mm and 0.2 rad
  EXPECT_NEAR(speed::feed_speed(piece, 0.3), 50 * units / 5, 1e-9);
  piece.feed.rotary_rad_s = 0.4;
  EXPECT_NEAR(speed::feed_speed(piece, 0.3), 0.4 * units / 0.2, 1e-9);
  piece.feed.path_units_s = 1.5;
  EXPECT_EQ(speed::feed_speed(piece, 0.3), 1.5);
}

// |dy/ds| of a polynomial piece by a difference of its values.
TEST(JointDerivatives, FeedSpeedOfAPolynomialFollowsItsTangent) {
  PathPoint from, to;
  from.y = from.d1 = from.d2 = from.d3 = to.y = to.d1 = to.d2 = to.d3 = Words::Zero();
  from.d1[kX] = 1;
  to.y.head<2>() << 4, 3;
  to.d1[kY] = 1.3;
  PlanPiece piece = plan(make_hermite(from, to, 5), 20);
  piece.feed.rotary_rad_s = FeedLimit::kNone;
  for (const double s : {0.5, 2.0, 4.5}) {
    const double tip = (piece.piece.at(s + 1e-5) - piece.piece.at(s - 1e-5)).head<3>().norm() / 2e-5;
    EXPECT_NEAR(speed::feed_speed(piece, s), 20 / tip, 1e-6);
  }
}

TEST(JointRates, SharesTakeOffAccelerationAndJerkOnly) {
  const speed::JointRates rates = speed::joint_rates(linear_joints(2), 0.9, 0.8);
  EXPECT_EQ(rates.count, 2);
  EXPECT_EQ(rates.velocity[1], 500);
  EXPECT_NEAR(rates.acceleration[1], 4500, 1e-9);
  EXPECT_NEAR(rates.jerk[1], 80000, 1e-9);
  EXPECT_NEAR(rates.velocity_inverse[1] * 500, 1, 1e-15);
  EXPECT_NEAR(rates.acceleration_inverse[1] * 4500, 1, 1e-15);
  EXPECT_NEAR(rates.jerk_inverse[1] * 80000, 1, 1e-15);
}

}  // namespace
}  // namespace trn::speed_test

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include "core/config.h"
#include "core/fault.h"
#include "core/ports.h"
#include "core/units.h"
#include "sim/canopen/emulated_node.h"
#include "tests/sim/can_field.h"

// The A of configs/fourth_axis.toml turns without an end: 36,000,000 counts a turn, in 32 bits.
namespace trn {
namespace {

constexpr int kJoint = 3;
constexpr double kTurn = 2 * kPi;
constexpr double kCount = kTurn / 36e6;

class EndlessField : public Field {
 public:
  explicit EndlessField(const Edits& edits = {}) : Field("fourth_axis.toml", edits) {}
  double place() { return node(kJoint).drive().joint().true_place(); }
  /// At full speed, up and down by a ramp.
  void turn(double turns) {
    const double speed = std::copysign(rad_from_deg(1800), turns), ramp = rad_from_deg(10000) * period_s();
    const double goal = setpoints.q[kJoint] + turns * kTurn;
    double& qd = setpoints.qd[kJoint];
    while (std::abs(goal - setpoints.q[kJoint]) > 0.6 * kTurn) {
      qd += std::clamp(speed - qd, -ramp, ramp);
      tick();
      ASSERT_EQ(feedback.fault, Fault::kOk)
          << drives.explain_fault(-1) << " at " << setpoints.q[kJoint] / kTurn;
    }
    while (qd != 0) {
      qd -= std::clamp(qd, -ramp, ramp);
      tick();
    }
    settle();
  }
};

TEST(EndlessAxis, StaysExactOverThousandsOfTurns) {
  EndlessField field;
  field.start();
  field.home();
  double worst = 0;
  std::int64_t overflows = 0;
  for (const double turns : {700.0, -2100.0, 1400.0}) {
    const double from = field.setpoints.q[kJoint];
    field.turn(turns);
    overflows += std::llround(std::abs(field.setpoints.q[kJoint] - from) / kTurn * 36e6 / 4294967296.0);
    worst = std::max({worst, std::abs(field.feedback.q[kJoint] - field.place()),
                      std::abs(field.setpoints.q[kJoint] - field.place())});
  }
  EXPECT_GT(overflows, 30);
  EXPECT_LT(worst, 1.01 * kCount);
  std::printf("endless axis: 4,200 turns at 5 a second, 32 bits full %d times: %.2f counts off at most\n",
              static_cast<int>(overflows), worst / kCount);
}

// Homed when its drive has run over already: the drive counts from its zero, and so does the joint.
TEST(EndlessAxis, HomesAfterItHasRunOver) {
  EndlessField field(Edits{{"counts_per_deg = 100000", "counts_per_deg = 100000\nhoming_method = 37"}});
  field.start();
  field.home();
  field.turn(100);
  EXPECT_GT(std::abs(field.feedback.q[kJoint]), 98 * kTurn);
  field.home();
  EXPECT_NEAR(field.feedback.q[kJoint], 0, 2 * kCount) << "method 37: here";
  EXPECT_LE(std::abs(field.node(kJoint).store().integer({0x6064, 0})), 2);
  field.turn(100);
  EXPECT_EQ(field.feedback.fault, Fault::kOk);
  EXPECT_GT(field.feedback.q[kJoint], 98 * kTurn);
}

std::string refused(const Edits& edits) {
  try {
    EndlessField field(edits);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(EndlessAxis, IsRefusedWhereItCannotBe) {
  EXPECT_NE(refused({{"endless = true", "min_deg = -36000.0\nmax_deg = 36000.0"}}).find("32 bits hold"),
            std::string::npos);
  EXPECT_NE(refused({{"endless = true", "endless = true\nmin_deg = 0.0"}}).find("no min_deg"),
            std::string::npos);
  EXPECT_NE(refused({{"name = \"Z\"\ntype = \"linear\"", "name = \"Z\"\ntype = \"linear\"\nendless = true"}})
                .find("only a rotary joint"),
            std::string::npos);
}

}  // namespace
}  // namespace trn

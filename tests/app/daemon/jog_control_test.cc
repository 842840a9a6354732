#include "app/daemon/jog_control.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "core/axes.h"

// Who holds a joint, and what somebody else may do to it meanwhile.
namespace trn {
namespace {

using std::chrono::milliseconds;
using trunnion::command_t;

constexpr JogControl::Time kBegin{};

class JogControlTest : public testing::Test {
 protected:
  JogControlTest() {
    report_.q_plan = JointVec::Zero(2);
    report_.motion = MotionState::kJogging;
  }
  static Joints joints() {
    Joint x;
    x.name = "X";
    x.limit = {-100, 100, 50, 500, 5000};
    Joint y = x;
    y.name = "Y";
    return {x, y};
  }
  static command_t command(std::int64_t client, double value, int alive_ms) {
    command_t out{};
    out.client = client;
    out.text = "X";
    out.value = value;
    out.alive_ms = alive_ms;
    return out;
  }
  /// As the controller does; the refusal, or "".
  std::string ask(const command_t& command, int ms) {
    const JogControl::Time now = kBegin + milliseconds(ms);
    const JogOrder order = jogs_.order(command, report_);
    if (const std::string refusal = jogs_.held_by_other(order, command, now); !refusal.empty())
      return refusal;
    jogs_.hear(order.joint, command, now);
    jogs_.hold(order, command, now);
    return "";
  }
  std::optional<int> silent(int ms) { return jogs_.take_silent(kBegin + milliseconds(ms)); }

  JogControl jogs_{joints(), nullptr, nullptr};
  CycleReport report_;
};

// Whoever held the button is gone: the joint stops, whatever others ask for in between.
TEST_F(JogControlTest, AStepOfSomebodyElseTakesNoDeadMan) {
  EXPECT_EQ(ask(command(1, 1, 100), 0), "");
  for (const double step : {0.1, -0.1})
    EXPECT_EQ(ask(command(2, step, 0), 50), "somebody else holds X; ask again when it was let go") << step;
  EXPECT_EQ(silent(99), std::nullopt);
  EXPECT_EQ(silent(100), 0);
  EXPECT_EQ(ask(command(2, 0.1, 0), 101), "");
  EXPECT_EQ(silent(100'000), std::nullopt) << "nobody holds a step";
}

TEST_F(JogControlTest, AStepOfTheHolderTakesNoDeadManEither) {
  EXPECT_EQ(ask(command(1, 1, 100), 0), "");
  EXPECT_EQ(ask(command(1, 0.1, 0), 50), "");
  EXPECT_NE(ask(command(2, 0.1, 0), 60), "");
  EXPECT_EQ(silent(100), 0);
}

TEST_F(JogControlTest, TwoMayHoldItTheSameWay) {
  EXPECT_EQ(ask(command(1, 1, 100), 0), "");
  EXPECT_EQ(ask(command(2, 1, 100), 50), "");
  EXPECT_NE(ask(command(1, -1, 100), 60), "");
  EXPECT_EQ(silent(149), std::nullopt);
  EXPECT_EQ(silent(150), 0);
}

TEST_F(JogControlTest, WhoeverStopsItIsObeyed) {
  EXPECT_EQ(ask(command(1, 1, 100), 0), "");
  EXPECT_EQ(ask(command(2, 0, 0), 50), "");
  EXPECT_EQ(ask(command(2, -5, 0), 51), "");
  EXPECT_EQ(silent(100'000), std::nullopt);
}

}  // namespace
}  // namespace trn

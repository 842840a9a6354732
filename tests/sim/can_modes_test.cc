#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/axes.h"
#include "core/config.h"
#include "core/fault.h"
#include "core/units.h"
#include "hal/can/bus.h"
#include "hal/can/cia402.h"
#include "hal/can/frame.h"
#include "hal/can/node_link.h"
#include "sim/canopen/emulated_node.h"
#include "tests/sim/can_field.h"
#include "tests/support/eds_sheet.h"

// Other modes than cyclic position, guarding instead of heartbeats, homing by method: the real master against
// emulated drives.
namespace trn {
namespace {

/// Every node of the cradle in this mode.
Edits in_mode(const std::string& mode) {
  return {{"homing_method = 5", "homing_method = 5\nmode = \"" + mode + "\""}};
}

/// Greatest distance of a drive from the setpoint that it has had two periods for, during a ramp.
double lag(Field& field, int periods) {
  double worst = 0;
  JointVec before = field.setpoints.q, last = before;
  for (int i = 0; i < periods; ++i) {
    field.tick();
    for (int k = 0; k < 5; ++k)
      worst = std::max(worst, std::abs(field.node(k).drive().joint().measured() - before[k]));
    before = last;
    last = field.setpoints.q;
  }
  return worst;
}

class Modes : public testing::TestWithParam<const char*> {};

TEST_P(Modes, ComeUpHomeFollowAndStand) {
  Field field("cradle_can.toml", in_mode(GetParam()));
  field.start();
  field.home();
  field.setpoints.qd = JointVec::Constant(5, 0.3);
  const double while_moving = lag(field, 500);
  ASSERT_TRUE(field.enabled()) << field.drives.explain_fault(-1);
  field.setpoints.qd.setZero();
  field.settle();
  for (int i = 0; i < 5; ++i) {
    const double scale = i < 3 ? 10000 : 10000 * kDegPerRad;
    EXPECT_NEAR(field.node(i).drive().joint().measured(), field.setpoints.q[i], 3 / scale) << "joint " << i;
  }
  EXPECT_EQ(field.feedback.fault, Fault::kOk);
  printf("    %s: %.4f mm or rad from the setpoint at 0.3 a second, at most\n", GetParam(), while_moving);
  EXPECT_LT(while_moving, 0.1);
}

// A lost setpoint stream must not leave a velocity behind.
TEST_P(Modes, StandAfterTheMasterFallsSilent) {
  Field field("cradle_can.toml", in_mode(GetParam()));
  field.start();
  field.home();
  field.setpoints.qd = JointVec::Constant(5, 0.3);
  for (int i = 0; i < 200; ++i) field.tick();
  field.bus().set_state(BusState::kDown);
  for (int i = 0; i < 300; ++i) field.tick();
  const double before = field.node(0).drive().joint().measured();
  for (int i = 0; i < 300; ++i) field.tick();
  EXPECT_NEAR(field.node(0).drive().joint().measured(), before, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Of402, Modes, testing::Values("csp", "csv", "ip", "pp"),
                         [](const auto& param) { return std::string(param.param); });

const Edits kGuarding = {{"heartbeat_ms = 50 ", "heartbeat_ms = 0\nguarding_ms = 20 "}};

TEST(SyncCounter, RunsFromOneToItsOverflowAndDrivesKnowIt) {
  Field field("cradle_can.toml", {{"missed_max = 3 ", "sync_counter = 10\nmissed_max = 3 "}});
  std::vector<int> counts;
  field.start();
  field.bus().on_frame([&](const CanFrame& frame) {
    if (frame.id == cob::kSync) counts.push_back(frame.size == 1 ? frame.data[0] : -1);
  });
  for (int i = 0; i < 100; ++i) field.tick();
  ASSERT_GE(counts.size(), 99u);
  for (std::size_t i = 1; i < counts.size(); ++i) ASSERT_EQ(counts[i], counts[i - 1] % 10 + 1) << i;
  EXPECT_EQ(field.node(3).store().integer({0x1019, 0}), 10);
  EXPECT_EQ(field.feedback.fault, Fault::kOk) << field.drives.explain_fault(-1);
  field.reset();  // writes both objects again while SYNC runs
  field.tick();
  EXPECT_GE(field.until([&] { return field.enabled(); }, 400), 0) << field.drives.explain_fault(-1);
}

TEST(NodeGuarding, TogglesAndFindsNothingWrong) {
  Field field("cradle_can.toml", kGuarding);
  field.start();
  int answers = 0;
  field.bus().on_frame([&](const CanFrame& frame) { answers += frame.id == 0x701 && !frame.remote; });
  for (int i = 0; i < 500; ++i) field.tick();
  EXPECT_NEAR(answers, 50, 2);
  for (const NodeLink& node : field.drives.master().master(0).nodes())
    EXPECT_EQ(node.shared().guard_toggle_errors.load(), 0u) << node.config().name;
  EXPECT_TRUE(field.enabled()) << field.drives.explain_fault(-1);
}

TEST(NodeGuarding, SeesANodeThatLeavesTheOperationalState) {
  Field field("cradle_can.toml", kGuarding);
  field.start();
  for (int i = 0; i < 100; ++i) field.tick();
  field.trouble(2, EmulatedNode::Trouble::kPreOperational, 0);
  EXPECT_GE(field.until([&] { return field.feedback.fault != Fault::kOk; }, 20), 0);
  EXPECT_EQ(field.feedback.fault_joint, 2);
}

/// Every node of the cradle by a data sheet of its own.
Edits by_sheet(const std::string& text) { return {{"eds/servo.eds", sheet_file(text)}}; }

// A drive that knows no 0x1016, as many do: asked every 50 ms, lost after three times that.
TEST(NodeGuarding, TakesThePlaceOfHeartbeatsThatADriveCannotHear) {
  Field field("cradle_can.toml", by_sheet(sheet_text({"1016"})));
  field.start();
  field.home();
  EXPECT_EQ(field.node(2).store().integer({0x100C, 0}), 50);
  EXPECT_EQ(field.node(2).store().integer({0x100D, 0}), 3);
  EXPECT_EQ(field.node(2).store().integer({0x1017, 0}), 0);
  for (int i = 0; i < 500; ++i) field.tick();
  ASSERT_EQ(field.feedback.fault, Fault::kOk) << field.drives.explain_fault(-1);
  field.trouble(2, EmulatedNode::Trouble::kNoHeartbeat, 1);
  const int periods = field.until([&] { return field.feedback.fault != Fault::kOk; }, 80);
  EXPECT_GT(periods, 45) << "150 ms, of which up to 50 may have passed";
  EXPECT_EQ(field.feedback.fault, Fault::kHeartbeatLost);
  EXPECT_NE(field.drives.explain_fault(2).find("no answer to node guarding (0x703)"), std::string::npos)
      << field.drives.explain_fault(2);
}

TEST(NodeGuarding, ADriveThatIsNotAskedAnyMoreStopsByItself) {
  Field field("cradle_can.toml", by_sheet(sheet_text({"1016"})));
  field.start();
  for (int i = 0; i < 100; ++i) field.tick();
  // SYNC goes on, so that nothing but life guarding can tell.
  EmulatedNode& node = field.node(2);
  const std::int64_t begin_ns = field.bus().now_ns();
  for (std::int64_t ms = 0; ms < 210; ms += 2) {
    if (ms < 100) {
      EXPECT_EQ(node.drive().state(), Cia402State::kOperationEnabled) << ms;
    }
    node.receive(sync_frame(0), begin_ns + 1'000'000 * ms);
    node.poll(begin_ns + 1'000'000 * ms);
  }
  EXPECT_EQ(node.drive().state(), Cia402State::kFault);
  EXPECT_EQ(node.store().integer({0x603F, 0}), 0x8130);
}

// Reset after a fault of the link: the drives were not restarted, and keep their zero, without a 0x1016.
TEST(NodeGuarding, ADriveThatWasNotRestartedKeepsItsZero) {
  Field field("cradle_can.toml", by_sheet(sheet_text({"1016"})));
  field.start();
  field.home();
  const unsigned all = field.feedback.homed_mask;
  field.bus().set_state(BusState::kDown, true);
  for (int i = 0; i < 100; ++i) field.tick();
  field.drives.quick_stop();
  for (int i = 0; i < 60; ++i) field.tick();
  field.reset();
  field.tick();
  ASSERT_GE(field.until([&] { return field.enabled(); }, 400), 0) << field.drives.explain_fault(-1);
  EXPECT_EQ(field.feedback.homed_mask, all);
  field.trouble(2, EmulatedNode::Trouble::kReset, 0);
  field.tick();
  field.drives.quick_stop();
  for (int i = 0; i < 100; ++i) field.tick();
  field.reset();
  field.tick();
  ASSERT_GE(field.until([&] { return field.enabled(); }, 400), 0) << field.drives.explain_fault(-1);
  EXPECT_EQ(field.feedback.homed_mask, all & ~4u);
}

TEST(BringUp, UnusedPdosKeepTheirIdentifierAndAreOff) {
  Field field("cradle_can.toml");
  field.start();
  EXPECT_EQ(field.node(0).store().integer({0x1800, 1}), 0x181) << "in use";
  EXPECT_EQ(field.node(0).store().integer({0x1803, 1}), 0x80000481);
  EXPECT_EQ(field.node(0).store().integer({0x1403, 1}), 0x80000501);
}

TEST(BringUp, ARefusedWishIsAWarningAndASkippedObjectIsNeverAsked) {
  Field field("cradle_can.toml");
  field.tick();
  field.trouble(1, EmulatedNode::Trouble::kRefuse, 0x6085);
  field.start();
  const std::vector<std::string> warnings = field.drives.warnings();
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].find("can0 node 2 (joint Y): writing 0x6085:0 'Quick stop deceleration'"), 0u)
      << warnings[0];
  Field skipping("cradle_can.toml", {{"homing_method = 5", "homing_method = 5\nskip = [\"0x6085\"]"}});
  skipping.tick();
  skipping.trouble(1, EmulatedNode::Trouble::kRefuse, 0x6085);
  skipping.start();
  EXPECT_TRUE(skipping.drives.warnings().empty());
}

TEST(BringUp, AnotherDriveThanTheDataSheetsIsRefused) {
  Field field("cradle_can.toml");
  field.tick();
  field.node(3).store().set({0x1018, 2}, 0x403);
  try {
    field.drives.bring_up();
    FAIL() << "another product came up";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what())
                  .find("0x1018:2 'Identity object: Product code' is 0x403; 0x402 is expected"),
              std::string::npos)
        << error.what();
  }
}

TEST(HomingMethods, HereTakesThePositionWithoutMoving) {
  Field field("cradle_can.toml", {{"homing_method = 5", "homing_method = 37"}});
  field.start();
  const double before = field.node(0).drive().joint().measured();
  field.home();
  EXPECT_EQ(field.node(0).drive().joint().measured(), before);
}

TEST(HomingMethods, OfAMakersOwnThereIsNoEmulation) {
  Field field("cradle_can.toml", {{"homing_method = 5", "homing_method = -3"}});
  try {
    field.drives.bring_up();
    FAIL() << "it came up";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("-3 is the maker's own homing method, and no emulation"),
              std::string::npos)
        << error.what();
  }
  Field knows("cradle_can.toml", {{"homing_method = 5", "homing_method = -3\nabsolute = true"}});
  knows.start();
}

// The index of the first joint lies beyond its limit switch.
TEST(HomingMethods, OneThatEndsAtALimitSwitchSaysSo) {
  Field field("cradle_can.toml",
              {{"homing_method = 5", "homing_method = 34"},
               {"counts_per_mm = 10000", "counts_per_mm = 10000\nindex_speed_mm_s = 100"},
               {"[[drives.bus]]", "[drives.emulation]\nindex_pitch_mm = 900\n[[drives.bus]]"}});
  field.start();
  field.drives.request_home(1);
  EXPECT_GE(field.until([&] { return field.feedback.fault != Fault::kOk; }, 60000), 0);
  EXPECT_EQ(field.feedback.fault, Fault::kHomingFailed);
  EXPECT_NE(field.drives.explain_fault(0).find("came to a limit switch before it found an index"),
            std::string::npos)
      << field.drives.explain_fault(0);
}

}  // namespace
}  // namespace trn

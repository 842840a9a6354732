#include <gtest/gtest.h>

#include <cmath>

#include "core/config.h"
#include "core/fault.h"
#include "core/ports.h"
#include "core/touch_probe.h"
#include "core/units.h"
#include "hal/can/frame.h"
#include "sim/canopen/emulated_node.h"
#include "tests/sim/can_field.h"

// The touch probe on the drives' own inputs: real master, PDOs and emulated drives.
namespace trn {
namespace {

constexpr double kTop_mm = -20.12345678;  // on no period and on no count
constexpr double kCount_mm = 1e-4;

/// The cradle with a block on its table; the spindle nose touches it at Z = top + 25.
const Edits kProbe = {{"missed_max = 3 ", "probe = \"drive\"\nmissed_max = 3 "},
                      {"[[drives.bus]]",
                       "[drives.emulation]\nprobe_length_mm = 25.0\n[[drives.emulation.plate]]\n"
                       "min_mm = [-50, -50, -60]\nmax_mm = [50, 50, -20.12345678]\n\n[[drives.bus]]"}};

/// Homed, the probe is inside the block.
void go_up(Field& field) {
  field.setpoints.qd[2] = 20;
  field.until([&] { return field.feedback.q[2] > 8; }, 1000);
  field.setpoints.qd.setZero();
  field.settle();
}

/// Arms, goes `mm_s` in Z until a contact is told, stops, waits; the feedback of the period that told.
Feedback touch(Field& field, bool contact, double mm_s) {
  field.drives.arm_touch(contact);
  EXPECT_GE(field.until([&] { return field.drives.touch().armed; }, field.drives.touch_periods()), 0);
  EXPECT_EQ(field.drives.touch().contact, !contact);
  field.setpoints.qd.setZero();
  field.setpoints.qd[2] = mm_s;
  EXPECT_GE(field.until([&] { return field.drives.touch().contact == contact; }, 10000), 0);
  const Feedback told = field.feedback;
  field.setpoints.qd.setZero();
  EXPECT_GE(
      field.until([&] { return field.drives.touch().latched_mask == 31; }, field.drives.touch_periods()), 0);
  return told;
}

TEST(CanTouch, EveryDriveTakesItsPositionAtTheEdge) {
  Field field("cradle_can.toml", kProbe);
  field.start();
  field.home();
  go_up(field);
  const Feedback told = touch(field, true, -5);
  const TouchProbe& probe = field.drives.touch();
  EXPECT_NEAR(probe.q[2], kTop_mm + 25, 0.5 * kCount_mm + 1e-9);
  EXPECT_GT(std::abs(told.q[2] - probe.q[2]), 2 * kCount_mm) << "the period's own place is another one";
  EXPECT_LT(std::abs(told.q[2] - probe.q[2]), 5 * 5 * field.period_s()) << "heard within five periods";
  for (const int i : {0, 1, 3, 4}) EXPECT_NEAR(probe.q[i], told.q[i], 1.01e-4) << "joint " << i;
  printf("    latched %.7f, the period said %.4f mm\n", probe.q[2], told.q[2]);
  field.settle();
  EXPECT_TRUE(field.enabled()) << field.drives.explain_fault(-1);
}

TEST(CanTouch, TheFallingEdgeWhenItLeaves) {
  Field field("cradle_can.toml", kProbe);
  field.start();
  field.home();
  go_up(field);
  touch(field, true, -5);
  field.settle();
  touch(field, false, 7);
  EXPECT_NEAR(field.drives.touch().q[2], kTop_mm + 25, 0.5 * kCount_mm + 1e-9);
}

TEST(CanTouch, WhoIsNotArmedLatchesNothing) {
  Field field("cradle_can.toml", kProbe);
  field.start();
  field.home();
  go_up(field);
  touch(field, true, -5);
  field.drives.disarm_touch();
  field.setpoints.qd[2] = 5;
  ASSERT_GE(field.until([&] { return !field.drives.touch().contact; }, 10000), 0);
  field.settle();
  EXPECT_EQ(field.drives.touch().latched_mask, 0u);
  EXPECT_FALSE(field.drives.touch().armed);
}

// Slow PDOs beside the fast ones: the budget still is what the bus carries, and the faults are seen.
TEST(CanTouch, TheBudgetHoldsWithSlowPdos) {
  Field field("cradle_can.toml", kProbe);
  field.start();
  for (int i = 0; i < 100; ++i) field.tick();
  std::uint64_t bits = 0;
  field.bus().on_frame(
      [&](const CanFrame& frame) { bits += static_cast<std::uint64_t>(worst_frame_bits(frame.size)); });
  const std::int64_t begin = field.bus().now_ns();
  for (int i = 0; i < 5000; ++i) field.tick();
  const double load = 1000.0 * static_cast<double>(bits) / static_cast<double>(field.bus().now_ns() - begin);
  const double budget = field.drives.config().buses[0].budget.load();
  printf("    budget %.4f, frames seen at their worst length %.4f\n", budget, load);
  EXPECT_NEAR(load / budget, 1, 0.02);
  field.trouble(2, EmulatedNode::Trouble::kSilent, 1);
  EXPECT_GE(field.until([&] { return field.feedback.fault == Fault::kDriveLost; }, 10), 0);
}

TEST(CanTouch, ADriveWithoutATouchProbeIsNamed) {
  std::ifstream in(source_dir() + "/configs/eds/servo.eds");
  std::string eds{std::istreambuf_iterator<char>(in), {}};
  eds.replace(eds.find("[60BB]"), 6, "[2FBB]");
  const std::string path = testing::TempDir() + "no_touch.eds";
  std::ofstream(path) << eds;
  try {
    Field field("cradle_can.toml", {kProbe[0], {"eds/servo.eds", path}});
    FAIL() << "no error";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("0x60BB"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace trn

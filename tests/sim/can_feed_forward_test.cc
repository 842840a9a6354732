#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "core/axes.h"
#include "core/config.h"
#include "core/units.h"
#include "hal/can/bus_budget.h"
#include "hal/can/can_config.h"
#include "hal/can/node_link.h"
#include "hal/can/pdo.h"
#include "hal/can/sdo.h"
#include "sim/canopen/emulated_node.h"
#include "tests/sim/can_field.h"
#include "tests/support/eds_sheet.h"

// Velocity and torque beside the place, on the wire: the real master against emulated drives with a
// mechanism.
namespace trn {
namespace {

constexpr char kConfig[] = "cradle_servo.toml";

std::vector<ObjectKey> objects(const Pdo& pdo) {
  std::vector<ObjectKey> out;
  for (const PdoField& field : pdo.fields) out.push_back(field.key);
  return out;
}

Edits in_mode(const std::string& mode) {
  Edits edits = {{"homing_method = 5", "homing_method = 5\nmode = \"" + mode + "\""}};
  if (mode != "cst") return edits;
  for (const char* rated : {"rated_force_N = 1500.0", "rated_force_N = 1200.0"})
    edits.push_back({rated, std::string(rated) + "\ntorque_gain_N_s_mm = 40"});
  edits.push_back({"rated_torque_Nm = 60.0", "rated_torque_Nm = 60.0\ntorque_gain_Nm_s = 450"});
  edits.push_back({"rated_torque_Nm = 30.0", "rated_torque_Nm = 30.0\ntorque_gain_Nm_s = 120"});
  return edits;
}

// Classic frames, as they are on most machines.
const Edits kClassic = {{"fd = true ", "fd = false "}, {"period_s = 0.001", "period_s = 0.004"}};

TEST(CanFeedForward, GoesInPdosOfEveryPeriod) {
  Field field(kConfig, kClassic);
  const NodeLink::Config& link = field.drives.config().buses[0].nodes[0].link;
  ASSERT_EQ(link.rpdos.size(), 2u);
  EXPECT_EQ(objects(link.rpdos[0]), (std::vector<ObjectKey>{{0x6040, 0}, {0x607A, 0}, {0x60B2, 0}}));
  EXPECT_EQ(objects(link.rpdos[1]), (std::vector<ObjectKey>{{0x60B1, 0}, {0x6060, 0}}));
  EXPECT_EQ(link.rpdos[1].every, 1);
  EXPECT_EQ(objects(link.tpdos[0]), (std::vector<ObjectKey>{{0x6041, 0}, {0x6064, 0}, {0x6077, 0}}));
}

// The same config without the section sends one frame less for each drive, and the bus budget knows.
TEST(CanFeedForward, CountsInTheBusBudget) {
  Edits plain = kClassic;
  plain.push_back({"[feed_forward]", "[kept_out]"});
  plain.push_back({"[[feed_forward.joint]]", "[[kept_out.joint]]"});
  Field with(kConfig, kClassic);
  Field without(kConfig, plain);
  const BusBudget &more = with.drives.config().buses[0].budget,
                  &less = without.drives.config().buses[0].budget;
  // Each of the five setpoint frames grows by torque's two bytes, less the byte of the mode, and a frame of
  // five bytes comes on top of it.
  const double frame_us = 1e6 * (worst_frame_bits(5) + worst_frame_bits(8) - worst_frame_bits(7)) / 1e6;
  EXPECT_NEAR(1e6 * (more.cyclic_s() - less.cyclic_s()), 5 * frame_us, 1e-6);
}

class CanFeedForwardModes : public testing::TestWithParam<const char*> {};

// A ramp, with the velocity told and the force that the mechanism needs at that speed.
TEST_P(CanFeedForwardModes, TakesTheLagAwayInTheDrivesOwnUnits) {
  double lag[2] = {0, 0};
  for (const bool told : {false, true}) {
    Field field(kConfig, in_mode(GetParam()));
    // Weight and friction of X, Y, Z (N), A and C (Nm), as the config's emulation has them.
    const double viscous[] = {0.9, 0.7, 0.6, 3, 0.8}, coulomb[] = {180, 150, 120, 12, 5},
                 weight[] = {0, 0, 600, 0, 0};
    const double speed[] = {100, -80, 60, 0.3, -0.5};
    field.start();
    field.setpoints.velocity_offset = field.setpoints.force_offset = JointVec::Zero(5);
    field.home();
    for (int k = 0; k < 5; ++k) {
      const double v = speed[k];
      field.setpoints.qd[k] = v;
      if (!told) continue;
      field.setpoints.velocity_offset[k] = v;
      field.setpoints.force_offset[k] = viscous[k] * v + std::copysign(coulomb[k], v) + weight[k];
    }
    JointVec before = field.setpoints.q, last = before;
    for (int i = 0; i < 600; ++i) {
      field.tick();
      ASSERT_TRUE(field.enabled()) << field.drives.explain_fault(-1);
      if (i > 400)
        lag[told] = std::max(lag[told], ((field.feedback.q - before).cwiseAbs().head<3>()).maxCoeff());
      before = last;
      last = field.setpoints.q;
    }
    // The drive tells the torque that it makes: friction and weight, at even speed.
    ASSERT_EQ(field.feedback.force.size(), 5);
    for (int k = 0; k < 5; ++k) {
      const double force = viscous[k] * speed[k] + std::copysign(coulomb[k], speed[k]) + weight[k];
      if (k == 3) continue;  // A turns its weight meanwhile
      EXPECT_NEAR(field.feedback.force[k], force, 0.05 * std::abs(force) + 2) << "joint " << k;
    }
  }
  std::printf("    %s: behind by %.4f mm, with feed-forward by %.4f mm\n", GetParam(), lag[0], lag[1]);
  EXPECT_LT(lag[1], 0.02);
}

INSTANTIATE_TEST_SUITE_P(Of402, CanFeedForwardModes, testing::Values("csp", "csv", "cst"),
                         [](const auto& param) { return std::string(param.param); });

TEST(CanFeedForward, LagsWithoutInCyclicPosition) {
  Field field(kConfig);
  field.start();
  field.home();
  field.setpoints.qd[0] = 100;
  for (int i = 0; i < 600; ++i) field.tick();
  // v over the gain of the drives' position loop, 40 a second.
  EXPECT_NEAR(field.setpoints.q[0] - 2 * field.period_s() * 100 - field.feedback.q[0], 100.0 / 40, 0.02);
}

TEST(CanFeedForward, IsLeftOutWhereTheDataSheetHasNoObject) {
  const std::string path = sheet_file(sheet_text({"60B1", "60B2"}));
  Field field(kConfig, {{"eds/servo.eds", path}});
  const NodeLink::Config& link = field.drives.config().buses[0].nodes[0].link;
  EXPECT_EQ(objects(link.rpdos[0]), (std::vector<ObjectKey>{{0x6040, 0}, {0x607A, 0}, {0x6060, 0}}));
  EXPECT_EQ(link.rpdos.size(), 1u);
  const std::vector<std::string> warnings = field.drives.warnings();
  ASSERT_EQ(warnings.size(), 10u);  // two objects of five drives
  EXPECT_NE(warnings[1].find("0x60B1"), std::string::npos) << warnings[1];
  EXPECT_NE(warnings[1].find("goes without this feed-forward"), std::string::npos);
}

// A drive that counts speeds in revolutions a minute is told its velocity in these.
TEST(CanFeedForward, IsInTheDrivesUnits) {
  const std::string path = sheet_file(rpm_sheet("0xFEB44700"));
  Field field(kConfig, {{"eds/servo.eds", path}});
  field.start();
  field.home();
  field.setpoints.velocity_offset = field.setpoints.force_offset = JointVec::Zero(5);
  field.setpoints.velocity_offset[0] = field.setpoints.qd[0] = 100;
  for (int i = 0; i < 400; ++i) field.tick();
  // 50000 counts a revolution are 5 mm: 100 mm/s are 1200 rpm, in hundredths.
  EXPECT_EQ(field.node(0).store().integer({0x60B1, 0}), 120000);
  EXPECT_NEAR(field.setpoints.q[0] - 2 * field.period_s() * 100 - field.feedback.q[0], 0, 0.02);
}

TEST(CanFeedForward, WantsToKnowWhatAThousandthIs) {
  try {
    Field field(kConfig, {{"rated_force_N = 1500.0", ""}});
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("'rated_force_N' must say"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace trn

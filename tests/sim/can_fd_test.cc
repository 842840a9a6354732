#include <gtest/gtest.h>

#include <cmath>

#include "core/axes.h"
#include "core/config.h"
#include "core/fault.h"
#include "hal/can/frame.h"
#include "sim/canopen/emulated_node.h"
#include "tests/sim/can_field.h"

// Setpoints and feedback in CAN FD frames: real master, emulated drives, a bus in memory.
namespace trn {
namespace {

const std::string kBus = "interface = \"can0\"";
const Edits kFd = {{"period_s = 0.002", "period_s = 0.001"},
                   {kBus, kBus + "\nfd = true\ndata_bitrate = 5000000"}};
const Edits kClassic = {kFd[0]};

TEST(CanFdField, FiveDrivesInOneMillisecond) {
  Field field("cradle_can.toml", kFd);
  field.start();
  field.home();
  field.setpoints.qd = JointVec::Constant(5, 0.5);
  int fd_frames = 0, classic_setpoints = 0;
  field.bus().on_frame([&](const CanFrame& frame) {
    const bool process = frame.id > 0x180 && frame.id < 0x280;
    fd_frames += process && frame.fd;
    classic_setpoints += process && !frame.fd;
  });
  for (int i = 0; i < 500; ++i) field.tick();
  ASSERT_TRUE(field.enabled()) << field.drives.explain_fault(-1);
  EXPECT_EQ(classic_setpoints, 0);
  EXPECT_NEAR(fd_frames, 500 * 10, 10);
  const JointVec last = field.setpoints.q;
  field.setpoints.qd.setZero();
  field.settle();
  for (int i = 0; i < 3; ++i) EXPECT_EQ(field.node(i).target_counts(), std::lround(last[i] * 10000));
}

TEST(CanFdField, ClassicFramesDoNotFitAndTheMessageKnowsAWayOut) {
  try {
    Field field("cradle_can.toml", kClassic);
    FAIL() << "no error";
  } catch (const ConfigError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("machine.period_s = 0.002"), std::string::npos) << text;
    EXPECT_NE(text.find("CAN FD (fd = true)"), std::string::npos) << text;
  }
}

TEST(CanFdField, TheBudgetIsWhatTheBusCarries) {
  Edits edits = kFd;
  edits.push_back({"missed_max = 3 ", "probe = \"drive\"\nmissed_max = 3 "});
  Field field("cradle_can.toml", edits);
  field.start();
  for (int i = 0; i < 100; ++i) field.tick();
  const std::int64_t begin = field.bus().now_ns();
  double busy_s = 0;
  field.bus().on_frame([&](const CanFrame& frame) { busy_s += worst_frame_s(frame, 1e6, 5e6); });
  for (int i = 0; i < 5000; ++i) field.tick();
  const double load = busy_s / (1e-9 * static_cast<double>(field.bus().now_ns() - begin));
  const double budget = field.drives.config().buses[0].budget.load();
  printf("    budget %.4f, frames seen at their worst length %.4f\n", budget, load);
  EXPECT_NEAR(load / budget, 1, 0.02);
}

TEST(CanFdField, AShortFrameIsNoMeasurement) {
  Field field("cradle_can.toml", kFd);
  field.start();
  field.trouble(2, EmulatedNode::Trouble::kShortPdo, 1);
  EXPECT_GE(field.until([&] { return field.feedback.fault == Fault::kDriveLost; }, 10), 0);
}

TEST(CanFdField, DataAreNotSlowerThanTheRest) {
  EXPECT_THROW(Field("cradle_can.toml", {{kBus, kBus + "\nfd = true\ndata_bitrate = 500000"}}), ConfigError);
}

// A DCF is a data sheet with the values that this drive is to have (CiA 306-1, 4.7).
TEST(Dcf, ParameterValuesAreWrittenAtBringUp) {
  std::ifstream in(source_dir() + "/configs/eds/servo.eds");
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::string path = testing::TempDir() + "servo.dcf";
  std::ofstream(path)
      << text << "\n[DeviceComissioning]\nNodeID=3\n\n[2110]\nParameterName=Filter\nDataType=7\n"
      << "AccessType=rw\nDefaultValue=5\nParameterValue=0x1234\n\n[2111]\nParameterName=Gain\n"
      << "DataType=8\nAccessType=rw\nDefaultValue=1\nParameterValue=-2.5\n";
  const std::string third = "id = 3\neds = \"eds/servo.eds\"";
  Field field("cradle_can.toml", {{third, "id = 3\neds = \"" + path + "\""}});
  EXPECT_EQ(field.node(2).store().integer({0x2110, 0}), 5);
  field.start();
  EXPECT_EQ(field.node(2).store().integer({0x2110, 0}), 0x1234);
  EXPECT_EQ(field.node(2).store().integer({0x2111, 0}) & 0xFFFFFFFF, 0xC0200000) << "-2.5 in IEEE 754";
  try {
    Field other("cradle_can.toml", {{"id = 2\neds = \"eds/servo.eds\"", "id = 2\neds = \"" + path + "\""}});
    FAIL() << "no error";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("this DCF is of node 3"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace trn

#include "sim/canopen/emulated_node.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "hal/can/cia402.h"
#include "hal/can/frame.h"
#include "hal/can/nmt.h"
#include "sim/simulated_joint.h"
#include "tests/support/paths.h"

// Network management of a node: CiA 301, 7.2.8 (boot-up, heartbeat, guarding) and 7.2.7 (emergencies).
namespace trn {
namespace {

constexpr std::int64_t kMs = 1'000'000;

class EmulatedNodes : public testing::Test {
 protected:
  EmulatedNodes() : node_(config()) { node_.poll(0); }

  static EmulatedNode::Config config() {
    EmulatedNode::Config config;
    config.id = 3;
    config.dictionary = load_eds(source_dir() + "/configs/eds/servo.eds", 3);
    SimulatedJoint::Config& joint = config.drive.joint;
    joint.servo = {250, 0.7, 1, 0.001};
    joint.following_error_max = 10;
    joint.quick_stop_deceleration = 1000;
    joint.switch_min = -1000;
    joint.switch_max = 1000;
    joint.homed = true;
    config.drive.counts_per_unit = 1000;
    return config;
  }
  void receive(const CanFrame& frame) { node_.receive(frame, now_ns_); }
  std::vector<CanFrame> frames() {
    std::vector<CanFrame> out;
    CanFrame frame;
    while (node_.next_frame(now_ns_ + kMs / 2, frame)) out.push_back(frame);
    return out;
  }
  /// A millisecond; the code of an emergency in it, or -1.
  int step(bool sync) {
    now_ns_ += kMs;
    if (sync) receive(sync_frame(0));
    node_.poll(now_ns_);
    int code = -1;
    for (const CanFrame& frame : frames())
      if (frame.id == 0x083) code = frame.data[0] | frame.data[1] << 8;
    return code;
  }
  /// Milliseconds until an emergency comes; -1 if none does.
  int steps_until(int wanted, bool sync, int limit = 200) {
    for (int i = 1; i <= limit; ++i)
      if (const int code = step(sync); code >= 0) {
        EXPECT_EQ(code, wanted);
        return i;
      }
    return -1;
  }
  void enable() {
    receive(nmt_frame(NmtCommand::kStart, 3));
    for (const int control : {0x06, 0x07, 0x0F, 0x0F, 0x0F}) {
      node_.store().set({0x6040, 0}, control);
      step(true);
    }
    ASSERT_EQ(node_.drive().state(), Cia402State::kOperationEnabled);
  }

  EmulatedNode node_;
  std::int64_t now_ns_ = 0;
};

TEST_F(EmulatedNodes, TellTheirBootUpAndObeyTheNetwork) {
  const std::vector<CanFrame> first = frames();
  ASSERT_EQ(first.size(), 1u);
  EXPECT_EQ(to_string(first[0]), "703#00");
  EXPECT_EQ(node_.nmt(), NmtState::kPreOperational);
  receive(nmt_frame(NmtCommand::kStart, 4));
  EXPECT_EQ(node_.nmt(), NmtState::kPreOperational) << "another's";
  receive(nmt_frame(NmtCommand::kStart, 0));
  EXPECT_EQ(node_.nmt(), NmtState::kOperational) << "everybody's";
  receive(nmt_frame(NmtCommand::kStop, 3));
  EXPECT_EQ(node_.nmt(), NmtState::kStopped);
  receive(nmt_frame(NmtCommand::kResetCommunication, 3));
  EXPECT_EQ(node_.nmt(), NmtState::kPreOperational);
  EXPECT_EQ(to_string(frames().at(0)), "703#00");
}

TEST_F(EmulatedNodes, AnswerGuardingWithATogglingBit) {
  frames();
  for (const int state : {0x7F, 0xFF, 0x7F}) {
    receive(guard_request(3));
    const std::vector<CanFrame> out = frames();
    ASSERT_EQ(out.size(), 1u);
    EXPECT_EQ(out[0].id, 0x703u);
    EXPECT_EQ(out[0].data[0], state);
  }
  receive(guard_request(4));
  EXPECT_TRUE(frames().empty());
}

TEST_F(EmulatedNodes, BeatInTheirTime) {
  node_.store().set({0x1017, 0}, 10);
  frames();
  std::vector<int> at_ms;
  for (int i = 1; i <= 40; ++i) {
    now_ns_ += kMs;
    node_.poll(now_ns_);
    for (const CanFrame& frame : frames()) {
      EXPECT_EQ(to_string(frame), "703#7F");
      at_ms.push_back(i);
    }
  }
  EXPECT_EQ(at_ms, (std::vector<int>{1, 11, 21, 31}));
}

// Heartbeat consumer (0x1016): 30 ms for node 127, counted from its first heartbeat on.
TEST_F(EmulatedNodes, AMasterThatFallsSilentStopsTheDrive) {
  node_.store().set({0x1016, 1}, 127 << 16 | 30);
  enable();
  EXPECT_EQ(steps_until(-1, true), -1) << "nobody has beaten yet";
  for (int i = 0; i < 10; ++i) {
    receive(heartbeat_frame(127, NmtState::kOperational));
    for (int k = 0; k < 29; ++k) ASSERT_EQ(step(true), -1);
  }
  receive(heartbeat_frame(127, NmtState::kOperational));
  for (int k = 0; k < 30; ++k) {
    receive(heartbeat_frame(5, NmtState::kOperational));  // another's heart
    ASSERT_EQ(step(true), -1) << k;
  }
  EXPECT_LE(steps_until(0x8130, true), 2);
  EXPECT_NE(node_.drive().state(), Cia402State::kOperationEnabled);
}

TEST_F(EmulatedNodes, WithoutAConsumerTimeNobodyIsMissed) {
  enable();
  receive(heartbeat_frame(127, NmtState::kOperational));
  EXPECT_EQ(steps_until(-1, true), -1);
}

TEST_F(EmulatedNodes, WithoutSyncTheDriveStops) {
  enable();
  EXPECT_NEAR(steps_until(0x8700, false), 6, 2);
}

}  // namespace
}  // namespace trn

#include "hal/can/node_setup.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

// One node's answers by hand; SDO frames as CiA 301, 7.2.4.3 lays them out.
namespace trn {
namespace {

constexpr std::int64_t kMs = 1'000'000;

NodeSetup::Config config_of_node_5() {
  NodeSetup::Config config;
  config.id = 5;
  config.name = "node 5";
  config.signature = {SetupStep::Kind::kCheck, {0x1016, 1}, {1, 2}, "signature", ""};
  config.steps = {{SetupStep::Kind::kWrite, {0x6060, 0}, {8}, "mode", "check the mode"}};
  config.sdo_timeout_ns = 500 * kMs;
  config.boot_timeout_ns = 3000 * kMs;
  config.retries = 1;
  return config;
}

std::vector<std::string> sent(NodeSetup& setup) {
  std::vector<std::string> out;
  for (CanFrame frame; setup.next_frame(frame);) out.push_back(to_string(frame));
  return out;
}

void answer(NodeSetup& setup, std::initializer_list<std::uint8_t> bytes, std::int64_t now_ns) {
  setup.receive(make_frame(0x585, bytes), now_ns);
}

const std::string kAsksSignature = "605#40 16 10 01 00 00 00 00", kWritesMode = "605#2F 60 60 00 08 00 00 00";

class NodeSetupSteps : public testing::Test {
 protected:
  NodeSetupSteps() {
    sent(setup);
    answer(setup, {0x4B, 0x16, 0x10, 0x01, 1, 2, 0, 0}, 0);
  }
  NodeSetup setup{config_of_node_5(), 0};
};

TEST(NodeSetup, ANodeThatStillBootsIsAskedAgainUntilItsTimeIsOver) {
  NodeSetup setup(config_of_node_5(), 0);
  EXPECT_EQ(sent(setup), (std::vector<std::string>{"000#80 05", kAsksSignature}));
  for (std::int64_t ms = 500; ms <= 2500; ms += 500) {
    setup.poll((ms - 1) * kMs);
    EXPECT_TRUE(sent(setup).empty()) << ms;
    setup.poll(ms * kMs);
    ASSERT_FALSE(setup.finished()) << ms << ": " << setup.error();
    const std::vector<std::string> frames = sent(setup);
    ASSERT_FALSE(frames.empty()) << ms;
    EXPECT_EQ(frames.back(), kAsksSignature) << ms;
  }
  setup.poll(3000 * kMs);
  EXPECT_TRUE(setup.finished());
  EXPECT_NE(setup.error().find("node 5: no answer (0x585) to SDO requests for 3 s"), std::string::npos)
      << setup.error();
}

TEST(NodeSetup, ItsSignatureTellsWhetherItWasRestarted) {
  NodeSetup kept(config_of_node_5(), 0), other(config_of_node_5(), 0), refusing(config_of_node_5(), 0);
  answer(kept, {0x4B, 0x16, 0x10, 0x01, 1, 2, 0, 0}, 0);
  EXPECT_FALSE(kept.was_restarted());
  answer(other, {0x4B, 0x16, 0x10, 0x01, 1, 3, 0, 0}, 0);
  EXPECT_TRUE(other.was_restarted());
  answer(refusing, {0x80, 0x16, 0x10, 0x01, 0, 0, 2, 6}, 0);
  EXPECT_TRUE(refusing.was_restarted());
  EXPECT_FALSE(refusing.finished());
}

TEST_F(NodeSetupSteps, ARefusedStepIsNotTriedAgain) {
  EXPECT_EQ(sent(setup), std::vector<std::string>{kWritesMode});
  answer(setup, {0x80, 0x60, 0x60, 0x00, 0x30, 0x00, 0x09, 0x06}, 0);
  EXPECT_TRUE(setup.finished());
  EXPECT_TRUE(sent(setup).empty());
  EXPECT_EQ(setup.error().find("node 5: writing 0x6060:0 'mode' = 0x8: SDO abort 0x06090030"), 0u)
      << setup.error();
}

TEST_F(NodeSetupSteps, AStepWithoutAnAnswerIsTriedAgainAsOftenAsTold) {
  EXPECT_EQ(sent(setup), std::vector<std::string>{kWritesMode});
  setup.poll(500 * kMs);
  ASSERT_FALSE(setup.finished()) << setup.error();
  EXPECT_EQ(sent(setup).back(), kWritesMode);
  setup.poll(1000 * kMs);
  EXPECT_TRUE(setup.finished());
  EXPECT_NE(setup.error().find("given up with 0x05040000"), std::string::npos) << setup.error();
}

TEST_F(NodeSetupSteps, ItIsDoneWithTheFirstHeartbeatOfTheOperationalState) {
  EXPECT_EQ(sent(setup), std::vector<std::string>{kWritesMode});
  answer(setup, {0x60, 0x60, 0x60, 0, 0, 0, 0, 0}, 0);
  EXPECT_EQ(sent(setup), std::vector<std::string>{"000#01 05"});
  setup.receive(heartbeat_frame(5, NmtState::kPreOperational), 1);
  setup.receive(heartbeat_frame(4, NmtState::kOperational), 1);
  EXPECT_FALSE(setup.finished());
  setup.poll(3000 * kMs - 1);
  EXPECT_FALSE(setup.finished());
  setup.receive(heartbeat_frame(5, NmtState::kOperational), 3000 * kMs - 1);
  EXPECT_TRUE(setup.finished());
  EXPECT_EQ(setup.error(), "");
}

NodeSetup::Config one_step(SetupStep::Kind kind, ObjectKey key, std::vector<std::uint8_t> bytes) {
  NodeSetup::Config config = config_of_node_5();
  config.steps = {{kind, key, std::move(bytes), "object", "look it up"}};
  return config;
}

// 0x06090030: value out of range; 0x06020000: no such object
TEST(NodeSetup, AWishThatIsRefusedIsAWarning) {
  NodeSetup setup(one_step(SetupStep::Kind::kWish, {0x6085, 0}, {8}), 0);
  answer(setup, {0x4B, 0x16, 0x10, 0x01, 1, 2, 0, 0}, 0);
  answer(setup, {0x80, 0x85, 0x60, 0x00, 0x30, 0x00, 0x09, 0x06}, 0);
  EXPECT_EQ(setup.error(), "");
  ASSERT_EQ(setup.warnings().size(), 1u);
  EXPECT_EQ(setup.warnings()[0].find("node 5: writing 0x6085:0 'object' = 0x8: SDO abort 0x06090030"), 0u)
      << setup.warnings()[0];
  EXPECT_EQ(sent(setup).back(), "000#01 05") << "it goes on";
  NodeSetup silent(one_step(SetupStep::Kind::kWish, {0x6085, 0}, {8}), 0);
  answer(silent, {0x4B, 0x16, 0x10, 0x01, 1, 2, 0, 0}, 0);
  silent.poll(500 * kMs);
  silent.poll(1000 * kMs);
  EXPECT_NE(silent.error(), "") << "silence is no refusal";
}

TEST(NodeSetup, AnObjectThatIsNotThereIsNoWarning) {
  for (const auto kind : {SetupStep::Kind::kWish, SetupStep::Kind::kWriteIfThere,
                          SetupStep::Kind::kCheckIfThere, SetupStep::Kind::kSetBits}) {
    NodeSetup setup(one_step(kind, {0x6085, 0}, {8}), 0);
    answer(setup, {0x4B, 0x16, 0x10, 0x01, 1, 2, 0, 0}, 0);
    answer(setup, {0x80, 0x85, 0x60, 0x00, 0, 0, 2, 6}, 0);
    EXPECT_EQ(setup.error(), "");
    EXPECT_TRUE(setup.warnings().empty());
  }
}

TEST(NodeSetup, ABitIsSetInWhatTheDriveHas) {
  NodeSetup setup(one_step(SetupStep::Kind::kSetBits, {0x1801, 1}, {0, 0, 0, 0x80}), 0);
  sent(setup);
  answer(setup, {0x4B, 0x16, 0x10, 0x01, 1, 2, 0, 0}, 0);
  EXPECT_EQ(sent(setup), std::vector<std::string>{"605#40 01 18 01 00 00 00 00"});
  answer(setup, {0x43, 0x01, 0x18, 0x01, 0x85, 0x02, 0, 0x40}, 0);
  EXPECT_EQ(sent(setup), std::vector<std::string>{"605#23 01 18 01 85 02 00 C0"});
  answer(setup, {0x60, 0x01, 0x18, 0x01, 0, 0, 0, 0}, 0);
  EXPECT_EQ(sent(setup), std::vector<std::string>{"000#01 05"});
}

TEST(NodeSetup, AGuardedNodeIsAskedForItsState) {
  NodeSetup::Config config = config_of_node_5();
  config.wait_for_heartbeat = false;
  config.guards = true;
  config.steps.clear();
  NodeSetup setup(config, 0);
  sent(setup);
  answer(setup, {0x4B, 0x16, 0x10, 0x01, 1, 2, 0, 0}, 0);
  EXPECT_EQ(sent(setup), std::vector<std::string>{"000#01 05"});
  setup.poll(0);
  EXPECT_EQ(sent(setup), std::vector<std::string>{to_string(guard_request(5))});
  setup.receive(make_frame(0x705, {0x85}), 1);
  EXPECT_TRUE(setup.finished()) << "operational, with the toggle bit";
  EXPECT_EQ(setup.error(), "");
}

TEST_F(NodeSetupSteps, ANodeWithAHeartbeatIsNotAskedForItsState) {
  answer(setup, {0x60, 0x60, 0x60, 0, 0, 0, 0, 0}, 0);
  EXPECT_EQ(sent(setup).back(), "000#01 05");
  setup.poll(1000 * kMs);
  EXPECT_TRUE(sent(setup).empty());
}

TEST_F(NodeSetupSteps, ABootUpMessageInBetweenIsAnError) {
  setup.receive(heartbeat_frame(5, NmtState::kBootUp), 1);
  EXPECT_TRUE(setup.finished());
  EXPECT_NE(setup.error().find("it booted while it was being set up"), std::string::npos);
}

TEST_F(NodeSetupSteps, FramesOfAnotherFormSayNothingOfItsState) {
  answer(setup, {0x60, 0x60, 0x60, 0, 0, 0, 0, 0}, 0);
  for (bool CanFrame::*form : {&CanFrame::extended, &CanFrame::error, &CanFrame::remote}) {
    CanFrame frame = heartbeat_frame(5, NmtState::kOperational);
    frame.*form = true;
    setup.receive(frame, 1);
    EXPECT_FALSE(setup.finished());
  }
  setup.receive(heartbeat_frame(5, NmtState::kOperational), 1);
  EXPECT_TRUE(setup.finished());
}

}  // namespace
}  // namespace trn

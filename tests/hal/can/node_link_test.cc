#include "hal/can/node_link.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>

// One node in the tick, frames by hand: TPDO 1 of node 5 has statusword and position.
namespace trn {
namespace {

class NodeLinkTest : public testing::Test {
 protected:
  NodeLinkTest() {
    NodeLink::Config config;
    config.id = 5;
    config.name = "node 5";
    config.tpdos = {{0x185, 0, 1, 1, false, {{{0x6041, 0}, 16, 0}, {{0x6064, 0}, 32, 2}}}};
    config.watch = {3, 10, 4};
    config.axis.counts_per_unit = 1000;
    link = std::make_unique<NodeLink>(config);
    set_up();
    step();
  }
  void feedback() { link->receive(make_frame(0x185, {0x40, 0x02, 0xE8, 0x03, 0, 0})); }
  void heartbeat(std::uint8_t byte) { link->receive(make_frame(0x705, {byte})); }
  void step() {
    link->step(0, 0, false);
    link->begin_period();
  }
  /// As the bring-up ends it, between two periods.
  void set_up() {
    link->shared().needs_setup = false;
    ++link->shared().setups;
    link->shared().watched = true;
    link->begin_period();
  }
  std::unique_ptr<NodeLink> link;
};

TEST_F(NodeLinkTest, ASilentDriveIsLostAndSetUpAgain) {
  heartbeat(5);
  feedback();
  step();
  EXPECT_EQ(link->shared().statusword.load(), 0x0240);
  for (int i = 0; i < 3; ++i) step();
  EXPECT_EQ(link->fault(), Fault::kOk) << "as many periods as it may miss";
  EXPECT_FALSE(link->shared().needs_setup.load());
  EXPECT_EQ(link->shared().missed.load(), 3u);
  step();
  EXPECT_EQ(link->fault(), Fault::kDriveLost);
  EXPECT_EQ(link->state(), DriveState::kLost);
  EXPECT_TRUE(link->shared().needs_setup.load());
}

// A late tick finds what the node said before and during its set-up in the queue, and then what it says now.
TEST_F(NodeLinkTest, WhatIsOlderThanASetupIsNoFault) {
  heartbeat(5);
  feedback();
  step();
  set_up();
  heartbeat(127);  // pre-operational, while it was set up
  heartbeat(0);
  link->receive(make_frame(0x085, {0x10, 0x82, 0x11, 0, 0, 0, 0, 0}));
  EXPECT_EQ(link->fault(), Fault::kOk);
  EXPECT_FALSE(link->shared().needs_setup.load());
  step();
  heartbeat(5);
  feedback();
  step();
  EXPECT_EQ(link->fault(), Fault::kOk);
  heartbeat(127);
  EXPECT_EQ(link->fault(), Fault::kDriveDropped);
  EXPECT_TRUE(link->shared().needs_setup.load());
}

TEST_F(NodeLinkTest, AMissingHeartbeatNeedsNoSetup) {
  heartbeat(5);
  for (int i = 0; i < 10; ++i) {
    feedback();
    step();
  }
  EXPECT_EQ(link->fault(), Fault::kOk);
  feedback();
  step();
  EXPECT_EQ(link->fault(), Fault::kHeartbeatLost);
  EXPECT_FALSE(link->shared().needs_setup.load());
  EXPECT_EQ(link->explain(),
            "node 5: no answer to node guarding (0x705) for more than 10 periods, feedback still comes");
}

TEST_F(NodeLinkTest, ANodeThatRestartsOrLeavesItsStateIsSetUpAgain) {
  feedback();
  step();
  heartbeat(0);
  EXPECT_EQ(link->fault(), Fault::kDriveRestarted);
  EXPECT_TRUE(link->shared().needs_setup.load());
  link->shared().needs_setup = false;
  link->reset();
  heartbeat(127);
  EXPECT_EQ(link->fault(), Fault::kDriveDropped);
  EXPECT_TRUE(link->shared().needs_setup.load());
}

TEST_F(NodeLinkTest, APdoOfAnotherLengthIsNoMeasurement) {
  feedback();
  step();
  link->receive(make_frame(0x185, {0x27, 0x02, 0, 0, 0}));
  link->receive(make_frame(0x185, {0x27, 0x02, 0, 0, 0, 0, 0}));
  step();
  EXPECT_EQ(link->shared().wrong_length.load(), 2u);
  EXPECT_EQ(link->shared().missed.load(), 1u);
  EXPECT_EQ(link->shared().statusword.load(), 0x0240);
}

// CiA 301, 7.2.8.3.2.1: the bit alternates between answers, and is 0 in the first after boot-up.
TEST_F(NodeLinkTest, GuardingAnswersAlternate) {
  step();
  for (const int byte : {0x05, 0x85, 0x05, 0x85}) heartbeat(static_cast<std::uint8_t>(byte));
  EXPECT_EQ(link->shared().guard_toggle_errors.load(), 0u);
  heartbeat(0x85);
  EXPECT_EQ(link->shared().guard_toggle_errors.load(), 1u);
  heartbeat(0x05);
  EXPECT_EQ(link->shared().guard_toggle_errors.load(), 1u);
}

TEST_F(NodeLinkTest, AGuardingAnswerIsAskedForEverySoManyPeriods) {
  NodeLink::Frames frames;
  int requests = 0;
  for (int i = 1; i <= 12; ++i) {
    const int count = link->fill(frames);
    requests += count;
    EXPECT_EQ(count, i % 4 == 0 ? 1 : 0) << i;
    EXPECT_TRUE(count == 0 || (frames[0].remote && frames[0].id == 0x705)) << i;
  }
  EXPECT_EQ(requests, 3);
}

TEST_F(NodeLinkTest, AnEmergencyIsAWarningAndKeptForTheMessage) {
  feedback();
  step();
  link->receive(make_frame(0x085, {0x10, 0x23, 0x02, 0, 0, 0, 0, 0}));
  EXPECT_EQ(link->fault(), Fault::kDriveWarning);
  EXPECT_FALSE(link->shared().needs_setup.load());
  step();
  EXPECT_NE(link->explain().find("emergency 0x2310 (continuous over-current), error register 0x02"),
            std::string::npos)
      << link->explain();
  link->receive(make_frame(0x085, {0x00, 0x00, 0x00, 0, 0, 0, 0, 0}));
  EXPECT_EQ(link->shared().error_register.load(), 0);
  EXPECT_EQ(link->shared().emergency.load(), 0x2310) << "the last one that said something";
}

TEST_F(NodeLinkTest, AnErrorCodeIsToldWhereThereIsOne) {
  feedback();
  step();
  for (int i = 0; i < 5; ++i) step();
  ASSERT_EQ(link->fault(), Fault::kDriveLost);
  EXPECT_EQ(link->explain().find("0x603F"), std::string::npos) << link->explain();
  link->shared().error_code = 0x8611;
  EXPECT_NE(link->explain().find("error code 0x603F = 0x8611"), std::string::npos) << link->explain();
}

}  // namespace
}  // namespace trn

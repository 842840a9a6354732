#include "hal/can/tick_sdo.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>

#include "hal/can/frame.h"
#include "tests/support/allocation_counter.h"

// Frames as CiA 301, 7.2.4.3 lays them out.
namespace trn {
namespace {

using State = TickSdo::State;

class TickSdoTest : public testing::Test {
 protected:
  std::string step() {
    CanFrame frame;
    return sdo.step(frame) ? to_string(frame) : "";
  }
  TickSdo sdo{5, 10};
};

TEST_F(TickSdoTest, WritesOnceAndWaitsForTheAnswer) {
  sdo.write({0x6060, 0}, 6, 1);
  EXPECT_EQ(step(), "605#2F 60 60 00 06 00 00 00");
  EXPECT_EQ(step(), "") << "once";
  sdo.receive(make_frame(0x585, {0x60, 0x61, 0x60, 0x00, 0, 0, 0, 0}));
  EXPECT_EQ(sdo.state(), State::kBusy) << "another object's";
  sdo.receive(make_frame(0x584, {0x60, 0x60, 0x60, 0x00, 0, 0, 0, 0}));
  EXPECT_EQ(sdo.state(), State::kBusy) << "another node's";
  sdo.receive(make_frame(0x585, {0x60, 0x60, 0x60, 0x00, 0, 0, 0, 0}));
  EXPECT_EQ(sdo.state(), State::kDone);
}

TEST_F(TickSdoTest, SizesOfWrites) {
  sdo.write({0x1234, 5}, 0x8765, 2);
  EXPECT_EQ(step(), "605#2B 34 12 05 65 87 00 00");
  sdo.forget();
  sdo.write({0x1234, 5}, 0x12345678, 4);
  EXPECT_EQ(step(), "605#23 34 12 05 78 56 34 12");
}

TEST_F(TickSdoTest, ReadsAsManyBytesAsWereSent) {
  for (const auto& [command, value] :
       {std::pair<int, std::uint32_t>{0x4F, 0x11}, {0x4B, 0x2211}, {0x43, 0x44332211}}) {
    sdo.read({0x6061, 0});
    EXPECT_EQ(step(), "605#40 61 60 00 00 00 00 00");
    sdo.receive(
        make_frame(0x585, {static_cast<std::uint8_t>(command), 0x61, 0x60, 0x00, 0x11, 0x22, 0x33, 0x44}));
    EXPECT_EQ(sdo.state(), State::kDone);
    EXPECT_EQ(sdo.value(), value);
    sdo.forget();
  }
}

TEST_F(TickSdoTest, AllocatesNothing) {
  const CanFrame answer = make_frame(0x585, {0x4F, 0x61, 0x60, 0x00, 8, 0, 0, 0});
  const long before = allocation_count();
  for (int i = 0; i < 10; ++i) {
    CanFrame frame;
    sdo.read({0x6061, 0});
    sdo.step(frame);
    sdo.receive(answer);
    EXPECT_EQ(sdo.value(), 8u);
  }
  EXPECT_EQ(allocation_count(), before);
}

TEST_F(TickSdoTest, ARefusalAndSilenceEndIt) {
  sdo.read({0x603F, 0});
  sdo.receive(make_frame(0x585, {0x80, 0x3F, 0x60, 0x00, 0, 0, 2, 6}));
  EXPECT_EQ(sdo.state(), State::kRefused);
  sdo.read({0x603F, 0});
  for (int i = 0; i < 10; ++i) {
    step();
    EXPECT_EQ(sdo.state(), State::kBusy) << i;
  }
  step();
  EXPECT_EQ(sdo.state(), State::kSilent);
  sdo.receive(make_frame(0x585, {0x4B, 0x3F, 0x60, 0x00, 1, 0, 0, 0}));
  EXPECT_EQ(sdo.state(), State::kSilent) << "too late";
}

}  // namespace
}  // namespace trn

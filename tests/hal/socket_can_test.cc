#include "hal/can/socket_can.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>

#include "core/fault.h"
#include "hal/can/bus.h"
#include "hal/can/can_master.h"
#include "hal/can/frame.h"

// On an interface of the kernel, named by TRN_CAN; tests/can-vm runs it where there is one.
namespace trn {
namespace {

CanFrame frame_of(std::uint32_t id, std::uint8_t number) {
  CanFrame frame;
  frame.id = id;
  frame.size = 1;
  frame.data[0] = number;
  return frame;
}

class SocketCanTest : public testing::Test {
 protected:
  void SetUp() override {
    const char* name = std::getenv("TRN_CAN");
    if (!name) GTEST_SKIP() << "TRN_CAN names no CAN interface";
    master_ = std::make_unique<SocketCan>(name, std::vector<CanFilter>{});
    other_ = std::make_unique<SocketCan>(name, std::vector<CanFilter>{});
    master_->confirm_sends();
  }
  static void send(SocketCan& from, std::uint32_t id, int count) {
    for (int i = 0; i < count; ++i) {
      const CanFrame frame = frame_of(id, static_cast<std::uint8_t>(i));
      ASSERT_EQ(from.send({&frame, 1}), 1);
    }
  }
  std::unique_ptr<SocketCan> master_, other_;
};

// Its caller takes a batch that is not full for the last one. Own frames among the first 64 must not make a
// full batch look like that.
TEST_F(SocketCanTest, AFloodIsTakenWholeThoughOwnFramesStandInIt) {
  send(*other_, 0x181, 40);
  send(*master_, 0x80, 30);
  send(*other_, 0x182, 40);
  std::array<CanFrame, 64> batch;
  ASSERT_EQ(master_->receive(batch), 64);
  for (std::size_t i = 0; i < 40; ++i) EXPECT_EQ(batch[i].id, 0x181u);
  for (std::size_t i = 40; i < 64; ++i) {
    EXPECT_EQ(batch[i].id, 0x182u);
    EXPECT_EQ(batch[i].data[0], i - 40);
  }
  ASSERT_EQ(master_->receive(batch), 16);
  EXPECT_EQ(batch[0].data[0], 24);
  EXPECT_EQ(master_->receive(batch), 0);
  EXPECT_GT(master_->confirmed_ns(), 0);
}

TEST_F(SocketCanTest, ItDoesNotHearItself) {
  EXPECT_EQ(master_->send({}), 0);
  const std::int64_t before_ns = master_->now_ns();
  send(*master_, 0x80, 50);
  std::array<CanFrame, 64> batch;
  EXPECT_EQ(master_->receive(batch), 0);
  EXPECT_EQ(other_->receive(batch), 50);
  constexpr std::int64_t kReadingNs = 500'000'000;  // between the readings of two clocks, on a busy host
  EXPECT_GE(master_->confirmed_ns(), before_ns - kReadingNs);
  EXPECT_LE(master_->confirmed_ns(), master_->now_ns() + kReadingNs);
}

// As at a reset behind an interface that was down: the tick goes on with the old endpoint while the new one
// is already open. What it hears of that is no second master; a frame of somebody else still is.
TEST_F(SocketCanTest, TheEndpointThatItReplacesIsNoSecondMaster) {
  CanMaster::Config config;
  config.period_s = 0.002;
  config.bus.interface = std::getenv("TRN_CAN");
  CanMaster master(config);
  master.attach(master_.get());
  for (int i = 0; i < 3; ++i) {
    master.send();
    master.receive();
  }
  SocketCan anew(config.bus.interface, master.tick_filters());
  anew.confirm_sends();
  master.send();
  master.attach(&anew);
  for (int i = 0; i < 4; ++i) {
    master.receive();
    ASSERT_EQ(master.fault(), Fault::kOk) << i;
    master.send();
  }
  send(*other_, 0x80, 1);
  master.receive();
  EXPECT_EQ(master.fault(), Fault::kForeignMaster);
}

}  // namespace
}  // namespace trn

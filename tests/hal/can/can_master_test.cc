#include "hal/can/can_master.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

// The master of a bus without nodes, on an endpoint by hand.
namespace trn {
namespace {

class Recorder final : public CanEndpoint {
 public:
  int send(std::span<const CanFrame> frames) TRN_RT override {
    const std::size_t taken = std::min(frames.size(), room);
    sent.insert(sent.end(), frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(taken));
    return static_cast<int>(taken);
  }
  int receive(std::span<CanFrame> frames) TRN_RT override {
    constexpr int kEnough = 1000;
    if (++batches < kEnough && floods) return static_cast<int>(frames.size());
    const std::size_t count = std::min(frames.size(), waiting.size());
    std::copy_n(waiting.begin(), count, frames.begin());
    waiting.erase(waiting.begin(), waiting.begin() + static_cast<std::ptrdiff_t>(count));
    return static_cast<int>(count);
  }
  BusState state() const TRN_RT override { return BusState::kOnline; }
  std::int64_t now_ns() const TRN_RT override { return time_ns; }
  std::int64_t confirmed_ns() const TRN_RT override { return confirmed; }
  void wait(std::int64_t) override {}
  std::string recover() override { return ""; }

  int count(std::uint32_t id) const {
    return static_cast<int>(
        std::count_if(sent.begin(), sent.end(), [&](const CanFrame& f) { return f.id == id; }));
  }
  std::vector<CanFrame> sent, waiting;
  std::size_t room = 1000;
  bool floods = false;  // every batch is full
  int batches = 0;      // that were asked for
  std::int64_t time_ns = 5'000'000'000, confirmed = 0;
};

CanMaster::Config config_with_heartbeat(std::uint32_t periods) {
  CanMaster::Config config;
  config.period_s = 0.002;
  config.master_id = 127;
  config.heartbeat_periods = periods;
  config.bus.interface = "can0";
  return config;
}

TEST(CanMaster, ItsHeartbeatComesAtOnceAndThenEverySoManyPeriods) {
  for (const std::uint32_t every : {0u, 1u, 2u, 5u}) {
    CanMaster master(config_with_heartbeat(every));
    Recorder endpoint;
    master.attach(&endpoint);
    for (int i = 0; i < 20; ++i) master.send();
    EXPECT_EQ(endpoint.count(0x080), 20);
    EXPECT_EQ(endpoint.count(0x77F), every == 0 ? 0 : 20 / static_cast<int>(every)) << every;
  }
}

TEST(CanMaster, JitterIsOfTheDistanceBetweenTwoSyncs) {
  CanMaster master(config_with_heartbeat(0));
  Recorder endpoint;
  master.attach(&endpoint);
  master.send();
  EXPECT_EQ(master.statistics().sync_jitter.max_us(), 0) << "the first one has no distance";
  endpoint.time_ns += 2'003'000;
  master.send();
  EXPECT_EQ(master.statistics().sync_jitter.max_us(), 3);
  endpoint.time_ns += 1'990'000;
  master.send();
  EXPECT_EQ(master.statistics().sync_jitter.max_us(), 10);
}

TEST(CanMaster, LatencyIsFromTheSendingToTheLastFrameOnTheBus) {
  CanMaster master(config_with_heartbeat(0));
  Recorder endpoint;
  master.attach(&endpoint);
  endpoint.confirmed = endpoint.time_ns;
  master.receive();
  EXPECT_EQ(master.statistics().bus_latency.max_us(), 0) << "nothing was sent yet";
  master.send();
  endpoint.confirmed = endpoint.time_ns + 450'000;
  master.receive();
  EXPECT_EQ(master.statistics().bus_latency.max_us(), 450);
}

TEST(CanMaster, ABusThatTakesNothingIsOverloadedAfterSoManyPeriods) {
  CanMaster::Config config = config_with_heartbeat(1);
  config.overload_max = 3;
  CanMaster master(config);
  Recorder endpoint;
  master.attach(&endpoint);
  endpoint.room = 1;  // of two
  for (int i = 0; i < 3; ++i) master.send();
  endpoint.room = 2;
  master.send();  // one good period in between
  endpoint.room = 1;
  for (int i = 0; i < 3; ++i) master.send();
  EXPECT_EQ(master.fault(), Fault::kOk);
  EXPECT_EQ(master.statistics().unsent.load(), 6u);
  EXPECT_EQ(master.statistics().sent.load(), 8u);
  master.send();
  EXPECT_EQ(master.fault(), Fault::kBusOverload);
  master.reset();
  EXPECT_EQ(master.fault(), Fault::kOk);
}

// A period that is sent, goes out and is heard of.
void one_period(CanMaster& master, Recorder& endpoint) {
  master.send();
  endpoint.confirmed = endpoint.time_ns + 100'000;
  master.receive();
  endpoint.time_ns += 2'000'000;
}

TEST(CanMaster, WhatOnlyTheMasterMaySendIsForeign) {
  for (const std::uint32_t id : {0x080u, 0x77Fu}) {
    CanMaster master(config_with_heartbeat(0));
    Recorder endpoint;
    master.attach(&endpoint);
    one_period(master, endpoint);
    one_period(master, endpoint);
    CanFrame extended = make_frame(id, {0});
    extended.extended = true;
    CanFrame remote = make_frame(id, {});
    remote.remote = true;
    endpoint.waiting = {extended, remote, make_frame(id ^ 1u, {0})};
    master.receive();
    EXPECT_EQ(master.fault(), Fault::kOk) << std::hex << id;
    endpoint.waiting = {make_frame(id, {0})};
    master.receive();
    EXPECT_EQ(master.fault(), Fault::kForeignMaster) << std::hex << id;
  }
}

// The interface was down, `reset` has opened it anew; the period that the old endpoint has queued goes out
// beside the new one's first. A second master that is there as well sends on, and is found behind it.
TEST(CanMaster, WhatTheEndpointBeforeHadToSendIsNotForeign) {
  for (const std::uint32_t id : {0x080u, 0x77Fu}) {
    CanMaster master(config_with_heartbeat(0));
    Recorder before, after;
    master.attach(&before);
    for (int i = 0; i < 3; ++i) one_period(master, before);
    master.attach(&after);
    for (int i = 0; i < 4; ++i) {
      after.waiting = {make_frame(id, {0})};
      master.receive();
      ASSERT_EQ(master.fault(), Fault::kOk) << "nothing of the new one is on the bus yet, period " << i;
      master.send();
    }
    for (int i = 0; i < 2; ++i) {
      after.waiting = {make_frame(id, {0})};
      one_period(master, after);
      ASSERT_EQ(master.fault(), Fault::kOk) << "the new one's period " << i;
    }
    after.waiting = {make_frame(id, {0})};
    one_period(master, after);
    EXPECT_EQ(master.fault(), Fault::kForeignMaster) << std::hex << id;
  }
}

// SYNC without data takes 55 bits, a heartbeat 8 + 47 + 41 / 4 = 65 (Davis et al. 2007).
TEST(CanMaster, TheLoadIsOfEveryFrameHeardAndSent) {
  CanMaster::Config config = config_with_heartbeat(1);
  config.bus.bitrate = 1e6;
  CanMaster master(config);
  Recorder endpoint;
  master.attach(&endpoint);
  for (int i = 0; i < 10; ++i) {
    endpoint.waiting = {make_frame(0x181, {1, 2, 3, 4, 5, 6, 7, 8})};
    master.receive();
    master.send();
  }
  EXPECT_NEAR(master.measured_load(), (55 + 65 + 135) * 1e-6 / 0.002, 1e-9);
}

// An answer to a service is not cyclic, whichever node it is of; the nodes are 1 to 127.
TEST(CanMaster, TheLoadIsWithoutServices) {
  CanMaster master(config_with_heartbeat(0));
  Recorder endpoint;
  master.attach(&endpoint);
  const auto load_with = [&](std::uint32_t id) {
    for (int i = 0; i < 10; ++i) {
      endpoint.waiting = {make_frame(id, {1, 2, 3, 4, 5, 6, 7, 8})};
      master.receive();
      master.send();
    }
    return master.measured_load();
  };
  const double bare = load_with(0x581);
  EXPECT_EQ(load_with(0x5FF), bare);
  EXPECT_GT(load_with(0x1FF), bare);
}

TEST(CanMaster, ANodeThatBabblesDoesNotHoldUpTheTick) {
  CanMaster master(config_with_heartbeat(0));
  Recorder endpoint;
  master.attach(&endpoint);
  master.receive();
  EXPECT_EQ(endpoint.batches, 1) << "nothing is left";
  endpoint.floods = true;
  master.receive();
  EXPECT_EQ(endpoint.batches, 1 + 32);
}

}  // namespace
}  // namespace trn

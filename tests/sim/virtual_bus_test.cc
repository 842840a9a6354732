#include "sim/canopen/virtual_bus.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

#include "hal/can/bus.h"
#include "hal/can/eds.h"
#include "hal/can/frame.h"
#include "hal/can/nmt.h"
#include "sim/canopen/emulated_node.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

constexpr std::int64_t kMs = 1'000'000;
const std::vector<CanFilter> kAll = {{0, 0}};

std::vector<std::uint32_t> heard(CanEndpoint& endpoint) {
  std::array<CanFrame, 64> frames;
  const int count = endpoint.receive(frames);
  std::vector<std::uint32_t> out;
  for (int i = 0; i < count; ++i) out.push_back(frames[static_cast<std::size_t>(i)].id);
  return out;
}

// Every controller offers its first frame, the lowest identifier wins; what is on the wire is not put off.
TEST(VirtualBus, TheLowestIdentifierGoesFirst) {
  VirtualBus bus(1e6);
  const auto a = bus.open(kAll), b = bus.open(kAll), listener = bus.open(kAll);
  const std::vector<CanFrame> of_a{make_frame(0x300, {1}), make_frame(0x100, {1})},
      of_b{make_frame(0x200, {1})};
  EXPECT_EQ(a->send(of_a), 2);
  EXPECT_EQ(b->send(of_b), 1);
  bus.run_until(kMs);
  EXPECT_EQ(heard(*listener), (std::vector<std::uint32_t>{0x200, 0x300, 0x100}));
  EXPECT_EQ(heard(*a), (std::vector<std::uint32_t>{0x200})) << "nobody hears himself";
  EXPECT_EQ(heard(*b), (std::vector<std::uint32_t>{0x300, 0x100}));
  EXPECT_EQ(bus.frames(), 3u);
}

// Eight bytes take 111 bits, and up to 24 more by stuffing; at 1 Mbit/s as many microseconds.
TEST(VirtualBus, FramesTakeTheirTime) {
  for (const double bitrate : {1e6, 250e3}) {
    VirtualBus bus(bitrate);
    const auto sender = bus.open(kAll);
    std::vector<std::int64_t> ends_ns;
    bus.on_frame([&](const CanFrame& frame) { ends_ns.push_back(frame.time_ns); });
    const std::vector<CanFrame> frames(5,
                                       make_frame(0x2AA, {0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55}));
    EXPECT_EQ(sender->send(frames), 5);
    bus.run_until(10 * kMs);
    EXPECT_EQ(bus.now_ns(), 10 * kMs);
    ASSERT_EQ(ends_ns.size(), 5u);
    EXPECT_EQ(sender->confirmed_ns(), ends_ns.back());
    const auto one_ns = static_cast<double>(bus.busy_ns()) / 5;
    EXPECT_GE(one_ns, 111e9 / bitrate);
    EXPECT_LE(one_ns, 135e9 / bitrate);
    for (std::size_t i = 1; i < 5; ++i)
      EXPECT_NEAR(static_cast<double>(ends_ns[i] - ends_ns[i - 1]), one_ns, 1);
  }
}

TEST(VirtualBus, FiltersLetThroughWhatMatches) {
  VirtualBus bus(1e6);
  const auto listener = bus.open({{0x180, 0x780}, {0x701, 0x7FF}});
  for (const std::uint32_t id : {0x17Fu, 0x180u, 0x1FFu, 0x200u, 0x700u, 0x701u})
    bus.inject(make_frame(id, {1}));
  CanFrame extended = make_frame(0x181, {1});
  extended.extended = true;
  bus.inject(extended);
  bus.run_until(2 * kMs);
  EXPECT_EQ(heard(*listener), (std::vector<std::uint32_t>{0x180, 0x1FF, 0x701}));
  EXPECT_EQ(bus.frames(), 7u);
}

TEST(VirtualBus, OffItCarriesNothingUntilItIsRepaired) {
  for (const bool repairable : {false, true}) {
    VirtualBus bus(1e6);
    const auto a = bus.open(kAll), b = bus.open(kAll);
    const std::vector<CanFrame> one{make_frame(0x100, {1})};
    bus.jam(true);
    EXPECT_EQ(a->send(one), 0);
    bus.jam(false);
    EXPECT_EQ(a->send(one), 1);
    bus.set_state(BusState::kBusOff, repairable);
    EXPECT_EQ(a->state(), BusState::kBusOff);
    EXPECT_EQ(a->send(one), 0);
    bus.run_until(kMs);
    EXPECT_TRUE(heard(*b).empty()) << "what waited is gone";
    EXPECT_EQ(a->recover().empty(), repairable);
    EXPECT_EQ(a->send(one), repairable ? 1 : 0);
    a->wait(kMs);
    EXPECT_EQ(bus.now_ns(), 2 * kMs);
    EXPECT_EQ(heard(*b).size(), repairable ? 1u : 0u);
  }
}

// A node that needs 20 us is on the wire within 10 us more, whenever it is asked: its frame of one byte takes
// 65 bits at most (Davis et al. 2007), at 1 Mbit/s as many microseconds.
TEST(VirtualBus, AnswersStartWhenTheyAreReady) {
  EmulatedNode::Config config;
  config.id = 3;
  config.dictionary = load_eds(source_dir() + "/configs/eds/servo.eds", 3);
  config.drive.joint.servo = {250, 0.7, 1, 0.001};
  config.answer_delay_ns = 20'000;
  EmulatedNode node(config);
  VirtualBus bus(1e6);
  bus.add(node);
  bus.run_until(kMs);
  std::int64_t asked_ns = 0, answered_ns = 0;
  bus.on_frame([&](const CanFrame& frame) { (frame.remote ? asked_ns : answered_ns) = frame.time_ns; });
  for (std::int64_t phase_ns = 0; phase_ns < 200'000; phase_ns += 20'000) {
    bus.run_until(bus.now_ns() + kMs + 20'000);
    bus.inject(guard_request(3));
    bus.run_until(bus.now_ns() + kMs);
    EXPECT_GE(answered_ns - asked_ns, 20'000 + 55'000) << phase_ns;
    EXPECT_LE(answered_ns - asked_ns, 30'000 + 65'000) << phase_ns;
  }
}

TEST(VirtualBus, AnEndpointMayOutliveIt) {
  auto bus = std::make_unique<VirtualBus>(1e6);
  const auto endpoint = bus->open(kAll);
  auto gone = bus->open(kAll);
  gone.reset();
  bus->inject(make_frame(0x100, {1}));
  bus->run_until(kMs);
  EXPECT_EQ(heard(*endpoint).size(), 1u);
  bus.reset();
  EXPECT_EQ(endpoint->state(), BusState::kDown);
  EXPECT_EQ(endpoint->send(std::vector<CanFrame>{make_frame(0x100, {1})}), 0);
  EXPECT_NE(endpoint->recover(), "");
}

}  // namespace
}  // namespace trn

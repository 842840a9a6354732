#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "hal/can/bus.h"
#include "hal/can/eds.h"
#include "hal/can/frame.h"
#include "hal/can/lss.h"
#include "hal/can/nmt.h"
#include "hal/can/sdo.h"
#include "hal/can/store_parameters.h"
#include "sim/canopen/emulated_node.h"
#include "sim/canopen/object_store.h"
#include "sim/canopen/virtual_bus.h"
#include "sim/simulated_joint.h"
#include "tests/sim/hostile_bus.h"
#include "tests/support/paths.h"

// Node ids, bit rates and parameters that stay in a node: the master's services against emulated nodes on a
// bus in memory.
namespace trn {
namespace {

constexpr std::int64_t kMs = 1'000'000;

class Shelf {
 public:
  EmulatedNode& add(int id, std::uint32_t serial, bool without_id, const std::string& sheet = "servo.eds",
                    const std::function<void(ObjectDictionary&)>& change = {}) {
    EmulatedNode::Config config;
    config.id = id;
    config.dictionary = load_eds(source_dir() + "/configs/eds/" + sheet, id);
    if (change) change(config.dictionary);
    SimulatedJoint::Config& joint = config.drive.joint;
    joint.servo = {250, 0.7, 1, 0.001};
    joint.following_error_max = 10;
    joint.quick_stop_deceleration = 1000;
    joint.switch_min = -1000;
    joint.switch_max = 1000;
    joint.homed = true;
    config.drive.counts_per_unit = 1000;
    config.serial = serial;
    config.without_id = without_id;
    config.stores = stores;
    config.bitrate = 1'000'000;
    nodes_.push_back(std::make_unique<EmulatedNode>(config));
    bus.add(*nodes_.back());
    return *nodes_.back();
  }
  void start() {
    bus.on_frame([this](const CanFrame& frame) {
      if (frame.id > 0x700 && frame.id < 0x780 && frame.data[0] == 0)
        booted.insert(static_cast<int>(frame.id - 0x700));
    });
    endpoint_ = bus.open({{0, 0}});
    bus.run_until(10 * kMs);
  }
  CanEndpoint& endpoint() { return *endpoint_; }
  template <typename Begin>
  std::string lss(Begin begin) {
    begin(master, bus.now_ns());
    return run_lss(*endpoint_, master);
  }
  void send(const CanFrame& frame) {
    endpoint_->send({&frame, 1});
    bus.run_until(bus.now_ns() + 20 * kMs);
  }
  void power_cycle(EmulatedNode& node) {
    node.trouble(EmulatedNode::Trouble::kReset, 0, bus.now_ns());
    bus.run_until(bus.now_ns() + 20 * kMs);
  }

  VirtualBus bus{1e6};
  LssMaster master{20 * kMs};
  std::set<int> booted;
  bool stores = true;  ///< of the nodes that are added from now on

 private:
  std::vector<std::unique_ptr<EmulatedNode>> nodes_;
  std::unique_ptr<CanEndpoint> endpoint_;
};

constexpr std::uint32_t kRevision = 0x10000, kProduct = 0x402;

// Three drives out of their boxes, one that is at work: each search finds the lowest serial number that is
// left.
TEST(CanLss, FindsAndNamesOneNodeAfterTheOther) {
  Shelf shelf;
  EmulatedNode& working = shelf.add(7, 1, false);
  std::vector<EmulatedNode*> fresh;
  for (const std::uint32_t serial : {0x80000003u, 0x00010002u, 0xFFFFFFFFu})
    fresh.push_back(&shelf.add(static_cast<int>(fresh.size()) + 1, serial, true));
  shelf.start();
  EXPECT_EQ(shelf.booted, std::set<int>{7});
  int id = 11;
  for (const std::uint32_t serial : {0x00010002u, 0x80000003u, 0xFFFFFFFFu}) {
    ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) { m.find(now); }), "");
    EXPECT_EQ(shelf.master.identity(), (LssIdentity{0, kProduct, kRevision, serial}));
    ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) { m.ask_node_id(now); }), "");
    EXPECT_EQ(shelf.master.node_id(), lss::kNoNodeId);
    ASSERT_EQ(shelf.lss([&](LssMaster& m, std::int64_t now) { m.set_node_id(id, now); }), "");
    ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) { m.store(now); }), "");
    ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) { m.leave(now); }), "");
    shelf.bus.run_until(shelf.bus.now_ns() + 20 * kMs);
    EXPECT_TRUE(shelf.booted.count(id)) << "with an id it boots";
    ++id;
  }
  EXPECT_NE(shelf.lss([](LssMaster& m, std::int64_t now) { m.find(now); }), "") << "nobody is left";
  EXPECT_EQ(working.active_id(), 7);
  EXPECT_EQ(fresh[1]->active_id(), 11);
  // Its objects answer under the new id, and its identifiers follow from it.
  SdoClient client({11, 100 * kMs, 1 << 16, 64, false});
  client.read({0x1800, 1}, shelf.bus.now_ns());
  CanFrame frame;
  while (client.next_frame(frame)) shelf.send(frame);
  std::array<CanFrame, 64> in;
  const int count = shelf.endpoint().receive(in);
  for (int i = 0; i < count; ++i) client.receive(in[static_cast<std::size_t>(i)], shelf.bus.now_ns());
  ASSERT_EQ(client.state(), SdoClient::State::kDone);
  EXPECT_EQ(get_le(client.data().data(), 4) & 0x7FF, 0x180u + 11);
  // Stored: it comes up with it.
  shelf.booted.clear();
  shelf.power_cycle(*fresh[1]);
  EXPECT_EQ(shelf.booted, std::set<int>{11});
}

TEST(CanLss, WhatIsNotStoredIsGoneWithThePower) {
  Shelf shelf;
  EmulatedNode& node = shelf.add(3, 5, true);
  shelf.start();
  ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) { m.find(now); }), "");
  ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) { m.set_node_id(9, now); }), "");
  ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) { m.leave(now); }), "");
  shelf.bus.run_until(shelf.bus.now_ns() + 20 * kMs);
  EXPECT_EQ(node.active_id(), 9);
  shelf.power_cycle(node);
  EXPECT_EQ(node.active_id(), lss::kNoNodeId);
}

TEST(CanLss, ANodeAtWorkIsSelectedByItsIdentityAndRenamedByAReset) {
  Shelf shelf;
  EmulatedNode& one = shelf.add(1, 100, false);
  EmulatedNode& two = shelf.add(2, 200, false);
  shelf.start();
  const std::string nobody = shelf.lss([](LssMaster& m, std::int64_t now) {
    m.select({0, kProduct, kRevision, 300}, now);
  });
  EXPECT_NE(nobody.find("serial 0x12C answers"), std::string::npos) << nobody;
  ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) {
    m.select({0, kProduct, kRevision, 200}, now);
  }),
            "");
  const std::string refused = shelf.lss([](LssMaster& m, std::int64_t now) { m.set_node_id(200, now); });
  EXPECT_NE(refused.find("1 to 127"), std::string::npos) << refused;
  ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) { m.set_node_id(20, now); }), "");
  ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) { m.leave(now); }), "");
  EXPECT_EQ(two.active_id(), 2) << "not before it is told";
  shelf.send(nmt_frame(NmtCommand::kResetCommunication, 2));
  EXPECT_EQ(two.active_id(), 20);
  EXPECT_EQ(one.active_id(), 1);
}

TEST(CanLss, ABitRateActsBehindALossOfPower) {
  Shelf shelf;
  EmulatedNode& node = shelf.add(1, 100, false);
  shelf.start();
  ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) {
    m.select({0, kProduct, kRevision, 100}, now);
  }),
            "");
  ASSERT_EQ(
      shelf.lss([](LssMaster& m, std::int64_t now) { m.set_bit_rate(*lss_bit_rate_index(500'000), now); }),
      "");
  ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) { m.store(now); }), "");
  ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) { m.ask_node_id(now); }), "") << "still understood";
  ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) { m.leave(now); }), "");
  shelf.booted.clear();
  shelf.power_cycle(node);
  EXPECT_TRUE(shelf.booted.empty());
  EXPECT_NE(shelf.lss([](LssMaster& m, std::int64_t now) {
    m.select({0, kProduct, kRevision, 100}, now);
  }),
            "");
}

// As many drives come from their makers: the serial number is 0 in all of them.
TEST(CanLss, TwoNodesOfOneIdentityGetNoNodeId) {
  Shelf shelf;
  EmulatedNode& one = shelf.add(1, 7, true);
  EmulatedNode& two = shelf.add(2, 7, true);
  shelf.start();
  ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) { m.find(now); }), "");
  const std::string told = shelf.lss([](LssMaster& m, std::int64_t now) { m.ask_node_id(now); });
  EXPECT_NE(told.find("one at a time"), std::string::npos) << told;
  ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) { m.leave(now); }), "");
  EXPECT_EQ(one.active_id(), lss::kNoNodeId);
  EXPECT_EQ(two.active_id(), lss::kNoNodeId);
}

struct Naming {
  bool done = false;
  std::string error;
  LssIdentity identity{};
  int struck = 0;
};

// What `trunnion can lss --node ID --store` does; whatever happens, everybody waits again behind it.
Naming name_a_node(Shelf& shelf, int id, unsigned seed, int strike) {
  HostileBus bus(shelf.endpoint(), lss::kToMaster, seed, strike, 20 * kMs);
  LssMaster& master = shelf.master;
  Naming out;
  const auto run = [&](auto begin) {
    if (!out.error.empty()) return;
    begin(bus.now_ns());
    out.error = run_lss(bus, master);
  };
  run([&](std::int64_t now) { master.find(now); });
  out.identity = master.identity();
  run([&](std::int64_t now) { master.ask_node_id(now); });
  const bool fresh = out.error.empty() && master.node_id() == lss::kNoNodeId;
  run([&](std::int64_t now) { master.set_node_id(id, now); });
  run([&](std::int64_t now) { master.store(now); });
  out.done = out.error.empty();
  EXPECT_TRUE(fresh || !out.done) << "seed " << seed;
  master.leave(bus.now_ns());
  run_lss(bus, master);
  out.struck = bus.struck();
  shelf.bus.run_until(shelf.bus.now_ns() + 100 * kMs);
  return out;
}

// "Done" is true, and an error names nobody wrongly: afterwards, a clean session finds everybody who is left.
TEST(CanLss, HostileAnswersMakeNoWrongNodeId) {
  int done = 0, failed = 0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(fmt::format("seed {}", seed));
    Shelf shelf;
    EmulatedNode& working = shelf.add(7, 1, false);
    std::array<EmulatedNode*, 2> fresh{};
    std::mt19937 random(seed);
    std::array<std::uint32_t, 2> serials = {static_cast<std::uint32_t>(random()) | 1,
                                            static_cast<std::uint32_t>(random()) & ~1u};
    if (serials[1] == 0) serials[1] = 2;
    for (std::size_t i = 0; i < 2; ++i) fresh[i] = &shelf.add(static_cast<int>(i) + 1, serials[i], true);
    shelf.start();
    const Naming naming = name_a_node(shelf, 11, seed, seed % 2 == 0 ? 1 : 5);
    (naming.done ? done : failed) += naming.struck > 0;
    EXPECT_EQ(working.active_id(), 7);
    int named = 0;
    for (std::size_t i = 0; i < 2; ++i) {
      if (naming.done && naming.identity[3] == serials[i]) {
        shelf.power_cycle(*fresh[i]);
        EXPECT_EQ(fresh[i]->active_id(), 11) << "what is said to be stored is stored";
      }
      named += fresh[i]->active_id() == 11;
    }
    EXPECT_TRUE(named == 1 || (!naming.done && named == 0)) << naming.error;
    // The two that were struck are well again.
    const Naming next = name_a_node(shelf, 12, seed, 0);
    EXPECT_EQ(next.error, "");
    EXPECT_TRUE(next.identity[3] == serials[0] || next.identity[3] == serials[1]);
  }
  EXPECT_GT(done, 5);
  EXPECT_GT(failed, 10);
}

std::string refusal(Shelf& shelf, int node, StoredPart part) {
  try {
    store_parameters(shelf.endpoint(), node, part, 100 * kMs);
  } catch (const StoreError& error) {
    return error.what();
  }
  return "";
}

TEST(CanStore, ParametersStayAndARestartIsStillSeen) {
  Shelf shelf;
  EmulatedNode& node = shelf.add(4, 0, false);
  shelf.start();
  ObjectStore& store = node.store();
  store.set({0x6085, 0}, 777);
  store.set({0x1017, 0}, 50);
  store.set({0x1016, 1}, 0x7F0096);
  store.set({0x607A, 0}, 12345);
  EXPECT_EQ(refusal(shelf, 4, StoredPart::kApplication), "");
  shelf.power_cycle(node);
  EXPECT_EQ(store.integer({0x6085, 0}), 777);
  EXPECT_EQ(store.integer({0x1017, 0}), 0) << "of the communication";
  EXPECT_EQ(store.integer({0x607A, 0}), 0) << "a setpoint is no parameter";
  store.set({0x1017, 0}, 50);
  store.set({0x1016, 1}, 0x7F0096);
  EXPECT_EQ(refusal(shelf, 4, StoredPart::kAll), "");
  shelf.power_cycle(node);
  EXPECT_EQ(store.integer({0x1017, 0}), 50);
  EXPECT_EQ(store.integer({0x1016, 1}), 0) << "by this the master sees that it was restarted";
}

TEST(CanStore, IsRefusedWithNodeObjectAndRemedy) {
  Shelf shelf;
  EmulatedNode& node = shelf.add(4, 0, false);
  shelf.start();
  node.store().set({0x6041, 0}, 0x0237);  // Operation Enabled
  EXPECT_NE(refusal(shelf, 4, StoredPart::kAll).find("node 4: 0x6041:0 says that the drive has power"),
            std::string::npos)
      << refusal(shelf, 4, StoredPart::kAll);
  node.store().set({0x6041, 0}, 0x0250);
  node.store().set({0x1010, 1}, 2);
  EXPECT_NE(refusal(shelf, 4, StoredPart::kAll).find("node 4: 0x1010:1 is 2: the node stores by itself"),
            std::string::npos);
  node.store().set({0x1010, 1}, 1);
  node.trouble(EmulatedNode::Trouble::kRefuse, 0x1010, shelf.bus.now_ns());
  EXPECT_NE(refusal(shelf, 4, StoredPart::kAll).find("0x1010:1 cannot be read: SDO abort 0x08000000"),
            std::string::npos)
      << refusal(shelf, 4, StoredPart::kAll);
  EXPECT_NE(refusal(shelf, 9, StoredPart::kAll).find("node 9: 0x6041:0 was not answered"), std::string::npos);
  // A node that does not tell its state, or what its restart is seen by, may have both.
  for (const auto& [index, part] :
       {std::pair{0x6041, StoredPart::kApplication}, {0x1016, StoredPart::kAll}}) {
    node.trouble(EmulatedNode::Trouble::kRefuse, index, shelf.bus.now_ns());
    EXPECT_NE(refusal(shelf, 4, part).find("cannot be read: SDO abort 0x08000000"), std::string::npos)
        << index << ": " << refusal(shelf, 4, part);
  }
  // Another word than "save" is refused by the node (CiA 301, 7.5.2.13).
  const std::vector<std::uint8_t> load = {'l', 'o', 'a', 'd'};
  EXPECT_EQ(node.store().write({0x1010, 1}, load), 0x08000020u);
}

TEST(CanStore, ANodeWhoseMemoryIsBrokenRefusesBothWays) {
  Shelf shelf;
  shelf.stores = false;
  EmulatedNode& node = shelf.add(4, 5, true);
  shelf.start();
  ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) { m.find(now); }), "");
  ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) { m.set_node_id(9, now); }), "");
  const std::string by_lss = shelf.lss([](LssMaster& m, std::int64_t now) { m.store(now); });
  EXPECT_NE(by_lss.find("the node cannot store by LSS"), std::string::npos) << by_lss;
  ASSERT_EQ(shelf.lss([](LssMaster& m, std::int64_t now) { m.leave(now); }), "");
  shelf.bus.run_until(shelf.bus.now_ns() + 20 * kMs);
  ASSERT_EQ(node.active_id(), 9);
  node.store().set({0x6085, 0}, 777);
  const std::string told = refusal(shelf, 9, StoredPart::kApplication);
  EXPECT_NE(told.find("node 9: 0x1010:3 was told to save, and refuses: SDO abort 0x06060000"),
            std::string::npos)
      << told;
  shelf.power_cycle(node);
  EXPECT_EQ(node.active_id(), lss::kNoNodeId);
  EXPECT_NE(node.store().integer({0x6085, 0}), 777);
}

// What is told to do instead is what the command's help has.
TEST(CanStore, TheRemedyIsACommandAsItIsTyped) {
  Shelf shelf;
  EmulatedNode& node = shelf.add(4, 0, false, "servo.eds", [](ObjectDictionary& sheet) {
    sheet.entries.at({0x1016, 1}).writable = false;
    sheet.entries.erase({0x1010, 2});
  });
  shelf.start();
  node.store().set({0x1016, 1}, 0x7F0096);
  std::string told = refusal(shelf, 4, StoredPart::kAll);
  EXPECT_NE(told.find("(trunnion can store 4 application)"), std::string::npos) << told;
  told = refusal(shelf, 4, StoredPart::kCommunication);
  EXPECT_NE(told.find("try trunnion can store 4 all"), std::string::npos) << told;
}

// "Stored" is true and hides no restart; what fails says which node and which object.
TEST(CanStore, HostileAnswersMakeNoFalseSuccess) {
  int done = 0, failed = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(fmt::format("seed {}", seed));
    Shelf shelf;
    EmulatedNode& node = shelf.add(4, 0, false);
    shelf.start();
    node.store().set({0x6085, 0}, 777);
    node.store().set({0x1016, 1}, 0x7F0096);
    HostileBus bus(shelf.endpoint(), 0x584, seed, 20, 100 * kMs);
    std::string error;
    try {
      store_parameters(bus, 4, StoredPart::kAll, 100 * kMs);
    } catch (const StoreError& told) {
      error = told.what();
    }
    (error.empty() ? done : failed) += bus.struck() > 0;
    EXPECT_TRUE(error.empty() || (error.starts_with("node 4: ") && error.find(" 0x") != std::string::npos))
        << error;
    shelf.bus.run_until(shelf.bus.now_ns() + 1000 * kMs);
    shelf.power_cycle(node);
    EXPECT_EQ(node.store().integer({0x1016, 1}), 0) << "stored, it would hide a restart";
    if (error.empty()) {
      EXPECT_EQ(node.store().integer({0x6085, 0}), 777) << "what is said to be stored is stored";
    }
    EXPECT_EQ(refusal(shelf, 4, StoredPart::kAll), "") << "well again";
  }
  EXPECT_GT(done, 20);
  EXPECT_GT(failed, 20);
}

// A status word of one byte, or a signature of two, is not what the data sheet promises.
TEST(CanStore, AValueOfTheWrongSizeIsNotBelieved) {
  for (const auto& [key, bytes, right] : {std::tuple{ObjectKey{0x6041, 0}, 1, 2},
                                          {ObjectKey{0x6041, 0}, 4, 2},
                                          {ObjectKey{0x1010, 1}, 1, 4},
                                          {ObjectKey{0x1016, 1}, 2, 4}}) {
    Shelf shelf;
    EmulatedNode& node = shelf.add(4, 0, false);
    shelf.start();
    *node.store().bytes(key) = std::vector<std::uint8_t>(static_cast<std::size_t>(bytes), 1);
    const std::string told = refusal(shelf, 4, StoredPart::kAll);
    EXPECT_NE(told.find(fmt::format("with {} bytes, where {} are right", bytes, right)), std::string::npos)
        << told;
    EXPECT_NE(told.find("node 4: 0x"), std::string::npos) << told;
  }
}

}  // namespace
}  // namespace trn

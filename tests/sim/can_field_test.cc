#include "tests/sim/can_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <random>

#include "core/fault.h"
#include "core/units.h"
#include "hal/can/bus.h"
#include "hal/can/frame.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/rounds.h"

// The real master against emulated nodes on a virtual bus: every row of the fault table, timed in periods.
namespace trn {
namespace {

TEST(CanField, ComesUpHomesAndFollowsToTheCount) {
  Field field("cradle_can.toml");
  field.start();
  EXPECT_EQ(field.feedback.homed_mask, 0u);
  field.home();
  field.setpoints.qd = JointVec::Constant(5, 0.5);
  for (int i = 0; i < 500; ++i) field.tick();
  ASSERT_TRUE(field.enabled()) << field.drives.explain_fault(-1);
  const JointVec last = field.setpoints.q;
  field.setpoints.qd.setZero();
  field.settle();
  for (int i = 0; i < 5; ++i) {
    const double scale = i < 3 ? 10000 : 10000 * kDegPerRad;
    EXPECT_EQ(field.node(i).target_counts(), std::lround(last[i] * scale)) << "joint " << i;
    EXPECT_NEAR(field.feedback.q[i], last[i], 2 / scale);
  }
}

TEST(CanField, TwoBusesAtOneMillisecond) {
  Field field("hexapod_can.toml");
  field.start();
  EXPECT_EQ(field.feedback.homed_mask, 63u) << "absolute encoders";
  EXPECT_NEAR(field.feedback.q[5], 664.1902952585139, 1e-4);
}

TEST(CanField, NoAllocationInATick) {
  Field field("cradle_can.toml");
  field.start();
  const long before = allocation_count();
  for (int i = 0; i < 1000; ++i) field.tick();
  EXPECT_EQ(allocation_count(), before);
}

// ---- the fault table
// -------------------------------------------------------------------------------------------

struct Row {
  const char* name;
  std::function<void(Field&)> cause;
  Fault fault;
  int periods_max;                   // from cause to fault
  std::function<void(Field&)> mend;  // what the fitter does
  bool position_kept;
  bool still_moves = false;  // the path-true stop belongs to the tick: drives stay enabled
};

std::ostream& operator<<(std::ostream& out, const Row& row) { return out << row.name; }

class FaultTable : public testing::TestWithParam<Row> {};

void nothing(Field&) {}
void speak(Field& field) { field.trouble(2, EmulatedNode::Trouble::kSilent, 0); }

using T = EmulatedNode::Trouble;

std::vector<Row> rows() {
  return {
      {"silent", [](Field& f) { f.trouble(2, T::kSilent, 1); }, Fault::kDriveLost, 6, speak, true},
      {"restarts", [](Field& f) { f.trouble(2, T::kReset, 0); }, Fault::kDriveRestarted, 3, nothing, false},
      {"emergency", [](Field& f) { f.trouble(2, T::kEmergency, 0x4210); }, Fault::kDriveWarning, 3, nothing,
       true, true},
      {"fault", [](Field& f) { f.trouble(2, T::kFault, 0x3210); }, Fault::kDriveFault, 4, nothing, true},
      {"drops", [](Field& f) { f.trouble(2, T::kDrop, 0); }, Fault::kDriveDropped, 3, nothing, true},
      {"pre_operational", [](Field& f) { f.trouble(2, T::kPreOperational, 0); }, Fault::kDriveDropped, 4,
       nothing, true},
      {"no_heartbeat", [](Field& f) { f.trouble(2, T::kNoHeartbeat, 1); }, Fault::kHeartbeatLost, 78,
       [](Field& f) { f.trouble(2, T::kNoHeartbeat, 0); }, true, true},
      {"heartbeat_very_late", [](Field& f) { f.trouble(2, T::kHeartbeatLate, 200'000); },
       Fault::kHeartbeatLost, 78, nothing, true, true},
      {"short_pdos", [](Field& f) { f.trouble(2, T::kShortPdo, 1); }, Fault::kDriveLost, 6,
       [](Field& f) { f.trouble(2, T::kShortPdo, 0); }, true},
      {"lies", [](Field& f) { f.trouble(2, T::kLie, 2'000'000); }, Fault::kFollowingError, 8,
       [](Field& f) { f.trouble(2, T::kLie, 0); }, true},
      {"bus_off", [](Field& f) { f.bus().set_state(BusState::kBusOff, true); }, Fault::kBusOff, 2, nothing,
       true},
      {"interface_down", [](Field& f) { f.bus().set_state(BusState::kDown, true); }, Fault::kBusDown, 2,
       nothing, true},
      {"queue_full", [](Field& f) { f.bus().jam(true); }, Fault::kBusOverload, 5,
       [](Field& f) { f.bus().jam(false); }, true},
      {"second_master", [](Field& f) { f.bus().inject(sync_frame(0)); }, Fault::kForeignMaster, 3, nothing,
       true},
      {"foreign_setpoints",
       [](Field& f) {
         f.bus().inject(make_frame(0x203, {0x0F, 0, 0, 0, 0, 0, 8}));
       },
       Fault::kForeignMaster, 3, nothing, true},
  };
}

/// Largest way of any plant over the next periods.
double motion(Field& field, int periods) {
  double largest = 0;
  std::vector<double> before;
  for (int i = 0; i < 5; ++i) before.push_back(field.node(i).drive().joint().measured());
  for (int k = 0; k < periods; ++k) field.tick();
  for (int i = 0; i < 5; ++i)
    largest = std::max(
        largest, std::abs(field.node(i).drive().joint().measured() - before[static_cast<std::size_t>(i)]));
  return largest;
}

void stop_as_the_tick_would(Field& field) {
  field.setpoints.qd.setZero();
  if (fault_info(field.feedback.fault).reaction == Reaction::kQuickStop) field.drives.quick_stop();
}

// Its questions and answers have taken the time; the power would come with the next period.
TEST(BringUp, AQuickStopTakesItBack) {
  Field field("cradle_can.toml");
  for (const bool again : {false, true}) {
    again ? field.reset() : field.drives.bring_up();
    field.drives.quick_stop();
    for (int i = 0; i < 1000; ++i) {
      field.tick();
      ASSERT_NE(field.feedback.state, DriveState::kEnabled) << i;
      for (int k = 0; k < 5; ++k) ASSERT_NE(field.node(k).drive().joint().state(), DriveState::kEnabled) << i;
    }
    EXPECT_EQ(field.feedback.fault, Fault::kOk) << field.drives.explain_fault(-1);
  }
  field.reset();
  ASSERT_GE(field.until([&] { return field.enabled(); }, 1000), 0) << field.drives.explain_fault(-1);
}

// Both are asked for between two periods: no moment of power at the end.
TEST(BringUp, OffMeansOffBehindIt) {
  Field field("cradle_can.toml");
  field.drives.bring_up();
  field.drives.shut_down();
  for (int i = 0; i < 1000; ++i) {
    field.tick();
    for (int k = 0; k < 5; ++k) ASSERT_NE(field.node(k).drive().joint().state(), DriveState::kEnabled) << i;
  }
  EXPECT_EQ(field.feedback.fault, Fault::kOk) << field.drives.explain_fault(-1);
}

TEST_P(FaultTable, IsSeenInTimeStopsAndRecovers) {
  const Row& row = GetParam();
  Field field("cradle_can.toml");
  field.start();
  field.home();
  const double z = field.node(2).drive().joint().measured();
  field.setpoints.qd = JointVec::Constant(5, 0.2);
  for (int i = 0; i < 100; ++i) field.tick();
  ASSERT_EQ(field.feedback.fault, Fault::kOk);
  row.cause(field);
  const int periods = field.until([&] { return field.feedback.fault != Fault::kOk; }, row.periods_max);
  RecordProperty("periods", periods);
  ASSERT_GE(periods, 0) << "not seen within " << row.periods_max << " periods";
  printf("    %-20s %-16s after %d periods: %s\n", row.name,
         std::string(fault_info(field.feedback.fault).name).c_str(), periods,
         field.drives.explain_fault(field.feedback.fault_joint).c_str());
  EXPECT_EQ(field.feedback.fault, row.fault) << fault_info(field.feedback.fault).name;
  stop_as_the_tick_would(field);
  for (int i = 0; i < 400; ++i) field.tick();
  EXPECT_LT(motion(field, 200), 1e-9) << "something still moves";
  EXPECT_EQ(field.enabled(), row.still_moves);
  row.mend(field);
  for (int i = 0; i < 60; ++i) field.tick();
  field.reset();
  field.tick();
  ASSERT_GE(field.until([&] { return field.enabled(); }, 400), 0) << field.drives.explain_fault(-1);
  EXPECT_EQ(field.feedback.fault, Fault::kOk);
  EXPECT_EQ((field.feedback.homed_mask >> 2 & 1) != 0, row.position_kept);
  if (row.position_kept) {
    EXPECT_NEAR(field.feedback.q[2], field.node(2).drive().joint().measured(), 1e-3);
  }
  EXPECT_LT(std::abs(field.node(2).drive().joint().measured() - z), row.position_kept ? 1.0 : 1e9);
}

INSTANTIATE_TEST_SUITE_P(Rows, FaultTable, testing::ValuesIn(rows()),
                         [](const auto& param) { return std::string(param.param.name); });

// What must not be taken for a fault.
TEST(CanField, HarmlessTroubleIsLivedThrough) {
  Field field("cradle_can.toml");
  field.start();
  field.trouble(1, T::kHeartbeatLate, 2000);  // one period
  field.trouble(2, T::kDuplicate, 1);
  field.trouble(3, T::kReorder, 1);
  for (int i = 0; i < 500; ++i) field.tick();
  EXPECT_EQ(field.feedback.fault, Fault::kOk) << field.drives.explain_fault(-1);
  EXPECT_TRUE(field.enabled());
}

TEST(CanField, ForeignTrafficOfEightyPercentInAll) {
  Field field("cradle_can.toml");
  field.start();
  const std::int64_t busy = field.bus().busy_ns(), begin = field.bus().now_ns();
  for (int i = 0; i < 500; ++i) {
    for (int k = 0; k < 3; ++k)
      field.bus().inject(make_frame(0x6F0, {1, 2, 3, 4, 5, 6, 7, static_cast<std::uint8_t>(i)}));
    field.tick();
  }
  const double load =
      static_cast<double>(field.bus().busy_ns() - busy) / static_cast<double>(field.bus().now_ns() - begin);
  EXPECT_GT(load, 0.7);
  EXPECT_EQ(field.feedback.fault, Fault::kOk) << field.drives.explain_fault(-1);
}

TEST(CanField, EveryRefusedBringUpStepIsNamed) {
  for (const int index : {0x1000, 0x1017, 0x1016, 0x1400, 0x1600, 0x1800, 0x1A00, 0x6060, 0x60C2, 0x6098}) {
    Field field("cradle_can.toml");
    field.tick();
    field.trouble(2, T::kRefuse, index);
    for (int i = 0; i < 5; ++i) field.tick();
    std::string message;
    try {
      field.drives.bring_up();
    } catch (const std::runtime_error& error) {
      message = error.what();
    }
    EXPECT_NE(message.find("can0 node 3 (joint Z)"), std::string::npos)
        << std::hex << index << ": " << message;
    EXPECT_NE(message.find("0x08000000"), std::string::npos) << message;
    EXPECT_EQ(field.until([&] { return field.enabled(); }, 50), -1);
    EXPECT_EQ(motion(field, 50), 0);
    field.trouble(2, T::kRefuse, 0);
    field.reset();
    EXPECT_GE(field.until([&] { return field.enabled(); }, kReady), 0) << field.drives.explain_fault(-1);
  }
}

TEST(CanField, AMissingNodeIsNamed) {
  Field field("cradle_can.toml");
  field.tick();
  field.trouble(4, T::kSilent, 1);
  try {
    field.drives.bring_up();
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()),
              "can0 node 5 (joint C): no answer (0x585) to SDO requests for 3 s; check its supply, the cable "
              "and its "
              "termination, the node id and the bit rate");
  }
}

// Where nobody acknowledges a frame, the interface sends the first one for ever and has no room for others.
TEST(CanField, BringUpEndsWhereTheInterfaceTakesNoFrames) {
  Field field("cradle_can.toml");
  field.bus().jam(true);
  try {
    field.drives.bring_up();
    FAIL() << "the drives came up on a bus that carries nothing";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("nobody on the bus acknowledges"), std::string::npos)
        << error.what();
  }
  field.bus().jam(false);
  field.start();
}

TEST(CanField, TheBudgetIsWhatTheBusCarries) {
  Field field("cradle_can.toml");
  field.start();
  for (int i = 0; i < 100; ++i) field.tick();
  std::uint64_t bits = 0;
  field.bus().on_frame(
      [&](const CanFrame& frame) { bits += static_cast<std::uint64_t>(worst_frame_bits(frame.size)); });
  const std::int64_t begin = field.bus().now_ns(), busy = field.bus().busy_ns();
  for (int i = 0; i < 5000; ++i) field.tick();
  const double span_ns = static_cast<double>(field.bus().now_ns() - begin);
  const double load = 1000.0 * static_cast<double>(bits) / span_ns;
  const double budget = field.drives.config().buses[0].budget.load();
  printf("    budget %.4f, frames seen at their worst length %.4f, at their true length %.4f\n", budget, load,
         static_cast<double>(field.bus().busy_ns() - busy) / span_ns);
  EXPECT_NEAR(load / budget, 1, 0.02);
}

TEST(CanField, RandomFramesMoveNothing) {
  const long count = test::rounds(20'000);
  Field field("cradle_can.toml");
  field.start();
  std::mt19937 random(7);
  for (long i = 0; i < count; i += 4) {
    for (int k = 0; k < 4; ++k) {
      CanFrame frame;
      // everything but what commands a drive by rights: NMT and the setpoints' identifiers
      do frame.id = random() % 0x800;
      while (frame.id == 0 ||
             (frame.id > 0x200 && frame.id < 0x580 && frame.id % 0x100 < 0x80 && frame.id / 0x80 % 2 == 0) ||
             frame.id >= 0x600);
      frame.size = static_cast<std::uint8_t>(random() % 9);
      frame.remote = random() % 20 == 0;
      for (auto& byte : frame.data) byte = static_cast<std::uint8_t>(random());
      field.bus().inject(frame);
    }
    field.tick();
    if (field.feedback.fault != Fault::kOk && i % 4000 == 0) {
      for (int k = 0; k < 400; ++k) field.tick();
      try {
        field.reset();
      } catch (const std::runtime_error&) {
      }
    }
  }
  for (int k = 0; k < 600; ++k) field.tick();
  for (int i = 0; i < 5; ++i) {
    EXPECT_LT(std::abs(field.node(i).drive().joint().measured()), 0.05) << "joint " << i;
  }
}

}  // namespace
}  // namespace trn

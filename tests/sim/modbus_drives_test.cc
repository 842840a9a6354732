#include "hal/modbus/modbus_drives.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <thread>

#include "core/axes.h"
#include "core/config.h"
#include "core/fault.h"
#include "core/machine.h"
#include "core/ports.h"
#include "core/units.h"
#include "sim/modbus/emulated_positioner.h"
#include "tests/support/paths.h"
#include "tests/support/rounds.h"

// Slow positioning drives: the tick's side against emulated drives on loopback TCP and a pseudo-terminal. The
// threads follow the tick, so that a period here is shorter than the machine's.
namespace trn {
namespace {

constexpr double kCountsPerMm = 1000, kCountsPerDeg = 100;
constexpr int kPatience_ms = 40;  // for a line's turn: a busy host may take that long, a silent drive does

struct Edit {
  std::string from, to;
};

/// A lift and an indexer.
std::string machine_text(int port, const std::vector<Edit>& edits = {}) {
  std::string text = R"([machine]
name = "indexer"
period_s = 0.02

[[joint]]
name = "Z"
type = "linear"
min_mm = -100.0
max_mm = 100.0
velocity_mm_s = 50.0
acceleration_mm_s2 = 500.0
jerk_mm_s3 = 5000.0

[[joint]]
name = "C"
type = "rotary"
min_deg = -360.0
max_deg = 360.0
velocity_deg_s = 90.0
acceleration_deg_s2 = 900.0
jerk_deg_s3 = 9000.0

[drives]
type = "modbus"
missed_max = 50

[drives.emulation]
homing_speed_mm_s = 50.0
homing_speed_deg_s = 50.0
homed = false

[[drives.line]]
name = "net"
address = "tcp:127.0.0.1:PORT"

[[drives.line]]
name = "serial"
address = "rtu:PTY:115200:N"

[[drives.axis]]
joint = "Z"
line = "net"
unit = 1
command = 0
answer = 0
counts_per_mm = 1000

[[drives.axis]]
joint = "C"
line = "serial"
unit = 2
command = 100
answer = 200
answer_table = "holding"
turnaround_ms = 2.0
counts_per_deg = 100
reverse = true
)";
  const auto replace = [&](const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    if (at == std::string::npos) throw std::runtime_error("the machine has no '" + from + "'");
    text.replace(at, from.size(), to);
  };
  replace("PORT", std::to_string(port));
  replace("PTY", testing::TempDir() + "trunnion_indexer");
  for (const Edit& edit : edits) replace(edit.from, edit.to);
  return text;
}

class Indexer : public testing::TestWithParam<const char*> {
 protected:
  Indexer() {
    for (int port = 15220; !field && port < 15270; ++port) {
      std::string text = machine_text(port);
      for (std::size_t at = 0; (at = text.find("unit = ", at)) != std::string::npos; at += 20)
        text.insert(at, std::string("mode = \"") + GetParam() + "\"\n");
      machine = std::make_unique<Machine>(read_machine(parse_config(text, "indexer.toml")));
      const ConfigTable section = machine->root.table("drives");
      const ModbusDrivesConfig config = read_modbus_drives(*machine, section);
      try {
        field = std::make_unique<EmulatedPositioners>(*machine, config, section);
        drives = std::make_unique<ModbusDrives>(config);
      } catch (const std::runtime_error&) {  // the port is taken
      }
    }
    setpoints.q = setpoints.qd = feedback.q = JointVec::Zero(2);
  }
  void tick() {
    if (feedback.state != DriveState::kEnabled) setpoints.q = feedback.q;
    const std::vector<long> before = turns();
    drives->exchange(setpoints, feedback);
    for (int ms = 0; ms < kPatience_ms && !all_turned(before); ++ms)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    field->step(0.02);
  }
  /// Exchanges of each drive so far, good and failed.
  std::vector<long> turns() const {
    std::vector<long> out;
    const std::string health = drives->health();
    for (std::size_t at = 0; (at = health.find(": ", at)) != std::string::npos; at += 2) {
      long answers = 0, failures = 0;
      if (std::sscanf(health.c_str() + at, ": %ld answers, %ld failures", &answers, &failures) == 2)
        out.push_back(answers + failures);
    }
    return out;
  }
  bool all_turned(const std::vector<long>& before) const {
    const std::vector<long> now = turns();
    for (std::size_t i = 0; i < now.size(); ++i)
      if (now[i] <= before[i]) return false;
    return true;
  }
  bool until(const std::function<bool()>& done, int limit = 1500) {
    for (int i = 0; i < limit; ++i) {
      if (done()) return true;
      tick();
    }
    return false;
  }
  bool enabled() const { return feedback.state == DriveState::kEnabled; }
  void start() {
    drives->bring_up();
    ASSERT_TRUE(until([&] { return enabled(); })) << drives->explain_fault(-1);
    ASSERT_EQ(feedback.homed_mask, 0u);
    ASSERT_EQ(feedback.limit_switch_mask, 0u);
    drives->request_home(3);
    tick();
    ASSERT_TRUE(until([&] { return enabled() && feedback.homed_mask == 3; })) << drives->explain_fault(-1);
  }
  double true_place(std::size_t axis) { return field->drive(axis).joint().measured(); }
  bool stands_at(double z, double c) {
    return until([&] {
      return std::abs(true_place(0) - z) <= 0.51 / kCountsPerMm &&
             std::abs(true_place(1) - c) <= 0.51 / kCountsPerDeg * kRadPerDeg &&
             (feedback.q - setpoints.q).cwiseAbs().maxCoeff() < 0.001;
    });
  }
  void go(double z, double c, int ticks) {
    const JointVec step = (JointVec(2) << z - setpoints.q[0], c - setpoints.q[1]).finished() / ticks;
    for (int i = 0; i < ticks; ++i) {
      setpoints.q += step;
      tick();
    }
  }

  std::unique_ptr<Machine> machine;
  std::unique_ptr<EmulatedPositioners> field;
  std::unique_ptr<ModbusDrives> drives;
  Setpoints setpoints;
  Feedback feedback;
};

TEST_P(Indexer, ComesUpHomesGoesAndStands) {
  start();
  go(12.345, 30 * kRadPerDeg, 60);
  EXPECT_TRUE(stands_at(12.345, 30 * kRadPerDeg))
      << true_place(0) << " mm, " << true_place(1) * kDegPerRad << " deg";
  go(-3, -75.5 * kRadPerDeg, 120);
  EXPECT_TRUE(stands_at(-3, -75.5 * kRadPerDeg))
      << true_place(0) << " mm, " << true_place(1) * kDegPerRad << " deg";
  EXPECT_EQ(feedback.fault, Fault::kOk);
}

TEST_P(Indexer, ASilentDriveIsLostAndComesBackWithItsPosition) {
  start();
  go(10, 0.5, 60);
  ASSERT_TRUE(stands_at(10, 0.5));
  field->trouble(1, {true, false, 0, 0});
  ASSERT_TRUE(until([&] { return feedback.state == DriveState::kLost; }, 200));
  EXPECT_EQ(feedback.fault, Fault::kDriveLost);
  EXPECT_EQ(feedback.fault_joint, 1);
  EXPECT_EQ(drives->explain_fault(0), "") << "the other joint";
  EXPECT_NE(drives->explain_fault(1).find("serial unit 2 (joint C)"), std::string::npos)
      << drives->explain_fault(1);
  drives->quick_stop();
  for (int i = 0; i < 50; ++i) tick();
  drives->reset_faults();
  EXPECT_THROW(drives->bring_up(), std::runtime_error) << "it is still silent";
  field->trouble(1, {});
  drives->reset_faults();
  drives->bring_up();
  ASSERT_TRUE(until([&] { return enabled(); })) << drives->explain_fault(-1);
  EXPECT_EQ(feedback.homed_mask, 3u) << "it had not lost its position";
  go(20, 1.0, 60);
  EXPECT_TRUE(stands_at(20, 1.0));
}

TEST_P(Indexer, AQuickStopTakesABringUpBack) {
  drives->bring_up();
  drives->quick_stop();
  for (int i = 0; i < 100; ++i) {
    tick();
    ASSERT_FALSE(enabled()) << i;
  }
  start();
}

TEST_P(Indexer, OffMeansOffBehindABringUp) {
  drives->bring_up();
  drives->shut_down();
  for (int i = 0; i < 100; ++i) {
    tick();
    ASSERT_FALSE(enabled()) << i;
  }
}

TEST_P(Indexer, AFaultOfTheDriveIsToldAndReset) {
  start();
  field->drive(0).fail(0x2310);
  ASSERT_TRUE(until([&] { return feedback.fault != Fault::kOk; }, 200));
  EXPECT_EQ(feedback.fault, Fault::kDriveFault);
  EXPECT_EQ(feedback.fault_joint, 0);
  drives->quick_stop();
  for (int i = 0; i < 20; ++i) tick();
  drives->reset_faults();
  drives->bring_up();
  EXPECT_TRUE(until([&] { return enabled(); })) << drives->explain_fault(-1);
  go(5, 0, 60);
  EXPECT_TRUE(stands_at(5, 0));
}

// Bytes of anything, some of them answers by their form: nothing may move that was not told to, and a reset
// brings the drive back where it is. The drive itself hears and obeys throughout.
TEST_P(Indexer, RandomAnswersMoveNothing) {
  const auto wanted = static_cast<std::uint64_t>(test::rounds(300, 100));
  start();
  go(10, 0.5, 60);
  ASSERT_TRUE(stands_at(10, 0.5));
  std::uint64_t answers = 0;
  for (std::uint32_t episode = 1; answers < wanted; ++episode) {
    const std::uint64_t before = field->line(0).requests();
    field->line(0).noise(episode);
    for (int i = 0; i < 60; ++i) {
      tick();
      ASSERT_NEAR(true_place(0), 10, 0.01) << "episode " << episode << ", period " << i;
      ASSERT_NEAR(true_place(1), 0.5, 0.01);
    }
    field->line(0).no_noise();
    answers += field->line(0).requests() - before;
    drives->reset_faults();
    drives->bring_up();
    ASSERT_TRUE(until([&] { return enabled() && feedback.fault == Fault::kOk; }))
        << drives->explain_fault(-1);
    ASSERT_EQ(feedback.homed_mask, 3u);
    ASSERT_NEAR(feedback.q[0], 10, 0.01);
    setpoints.q = feedback.q;
  }
  printf("    %llu random answers\n", static_cast<unsigned long long>(answers));
}

INSTANTIATE_TEST_SUITE_P(Modes, Indexer, testing::Values("pp", "csp"),
                         [](const auto& param) { return std::string(param.param); });

std::string error_of(const std::vector<Edit>& edits) {
  try {
    const Machine machine = read_machine(parse_config(machine_text(1502, edits), "indexer.toml"));
    read_modbus_drives(machine, machine.root.table("drives"));
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(ModbusDrivesConfig, APeriodThatIsTooShortIsRefusedWithTheArithmetic) {
  EXPECT_EQ(error_of({}), "");
  const std::string error = error_of({{"115200", "9600"}, {"turnaround_ms = 2.0", "turnaround_ms = 2.03"}});
  // (25 + 21 characters and 4 pauses of 3.5) x 11 bits at 9600 baud = 68.75 ms, + 2 x 2.03 ms = 72.81 ms
  for (const char* part :
       {"indexer.toml:", "'serial'", "72.8 ms", "period of 20 ms", "machine.period_s = 0.105"})
    EXPECT_NE(error.find(part), std::string::npos) << part << " is not in\n" << error;
  EXPECT_EQ(error_of({{"115200", "9600"},
                      {"period_s = 0.02", "period_s = 0.1"},
                      {"turnaround_ms = 2.0", "turnaround_ms = 0.5"}}),
            "");
}

TEST(ModbusDrivesConfig, EveryJointHasOneDriveOnAnUnitOfItsOwn) {
  EXPECT_NE(error_of({{"joint = \"C\"\nline", "joint = \"Z\"\nline"},
                      {"counts_per_deg = 100", "counts_per_mm = 100"}})
                .find("already"),
            std::string::npos);
  EXPECT_NE(error_of({{"line = \"serial\"\nunit = 2", "line = \"net\"\nunit = 1"}}).find("already"),
            std::string::npos);
  EXPECT_NE(error_of({{"answer = 200", "answer = 102"}}).find("overlap"), std::string::npos);
}

}  // namespace
}  // namespace trn

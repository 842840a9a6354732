#include "app/session/signals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "core/fault.h"
#include "core/machine.h"
#include "core/units.h"
#include "kernel/rt_messages.h"
#include "tests/support/paths.h"

// The list of what can be watched, and the numbers behind its names.
namespace trn {
namespace {

class Signals : public testing::Test {
 protected:
  Signals() : assembly_(assemble(source_dir() + "/configs/cradle_servo.toml")), table_(table()) {
    report_.q_plan = report_.q_setpoint = report_.q_measured = JointVec::Zero(5);
  }
  SignalTable table() const {
    return {assembly_.machine, assembly_.corrections.setpoint.get(), assembly_.drives->feedback_periods()};
  }
  double value(const std::string& name) const {
    const Signal* signal = table_.find(name);
    EXPECT_NE(signal, nullptr) << name;
    return signal ? signal->value(row_.data()) : 0;
  }
  void sample() {
    row_.assign(table_.columns(), 0);
    sampler_.sample(report_, row_.data());
    ++report_.period;
  }

  Assembly assembly_;
  SignalTable table_;
  SignalSampler sampler_{table_};
  CycleReport report_;
  std::vector<double> row_;
};

TEST_F(Signals, HaveNamesOfTheirOwnUnitsAndSentences) {
  std::set<std::string> names;
  for (const Signal& signal : table_.signals()) {
    EXPECT_TRUE(names.insert(signal.name).second) << signal.name;
    EXPECT_FALSE(signal.meaning.empty()) << signal.name;
    EXPECT_LT(static_cast<std::size_t>(signal.column), table_.columns());
  }
  EXPECT_EQ(table_.find("X.measured")->unit, "mm");
  EXPECT_EQ(table_.find("A.velocity")->unit, "deg/s");
  EXPECT_EQ(table_.find("A.force")->unit, "Nm");
  EXPECT_EQ(table_.find("X.nothing"), nullptr);
}

TEST_F(Signals, SpeakOfJointsInMmAndDegrees) {
  const double dt = assembly_.machine.period_s;
  for (int k = 0; k < 10; ++k) {
    const double t = k * dt;
    report_.q_setpoint[0] = 100 * t + 500 * t * t;
    report_.q_measured[0] = k < 2 ? 0 : 100 * (t - 2 * dt) + 500 * (t - 2 * dt) * (t - 2 * dt) - 0.003;
    report_.q_setpoint[3] = kRadPerDeg * 40 * t;
    report_.force = JointVec::Constant(5, 12.5);
    report_.words[0] = {0x1237, 0x000F};
    sample();
  }
  const double t = 9 * dt;
  EXPECT_NEAR(value("X.setpoint"), 100 * t + 500 * t * t, 1e-12);
  // The measurement of a setpoint comes two periods later.
  EXPECT_NEAR(value("X.following_error"), 0.003, 1e-12);
  EXPECT_NEAR(value("X.velocity"), 100 + 1000 * (t - dt / 2), 1e-9);
  EXPECT_NEAR(value("X.acceleration"), 1000, 1e-5);
  EXPECT_NEAR(value("A.velocity"), 40, 1e-9);
  EXPECT_EQ(value("X.force"), 12.5);
  EXPECT_EQ(value("X.statusword"), 0x1237);
  EXPECT_EQ(value("X.controlword"), 0x0F);
  EXPECT_TRUE(std::isnan(value("X.current")));
}

TEST_F(Signals, SpeakOfTheMachine) {
  report_.line = 42;
  report_.override_now = 0.5;
  report_.fault = Fault::kFollowingError;
  report_.inputs = 1u | std::uint64_t{1} << 35;
  report_.outputs = std::uint64_t{1} << 63;
  report_.wake_us = 3.5;
  report_.tick_us = 17;
  sample();
  EXPECT_EQ(value("line"), 42);
  EXPECT_EQ(value("rate"), 0.5);
  EXPECT_EQ(value("fault"), static_cast<double>(Fault::kFollowingError));
  EXPECT_EQ(value("input.0"), 1);
  EXPECT_EQ(value("input.1"), 0);
  EXPECT_EQ(value("input.35"), 1);
  EXPECT_EQ(value("input.3"), 0);
  EXPECT_EQ(value("output.63"), 1);
  EXPECT_EQ(value("wake"), 3.5);
  EXPECT_EQ(value("tick"), 17);
}

// Reports that were lost must not look like a jump.
TEST_F(Signals, AreAtRestBehindAGap) {
  for (int k = 0; k < 5; ++k) {
    report_.q_setpoint[0] = k;
    sample();
  }
  report_.period += 100;
  report_.q_setpoint[0] = 50;
  report_.q_measured[0] = 50;
  sample();
  EXPECT_EQ(value("X.velocity"), 0);
  EXPECT_EQ(value("X.acceleration"), 0);
  EXPECT_EQ(value("X.following_error"), 0);
}

TEST(SignalsOfCorrections, AreNamedAfterTheirSections) {
  const Assembly assembly = assemble(source_dir() + "/configs/head_screws.toml");
  const SignalTable table(assembly.machine, assembly.corrections.setpoint.get(), 0);
  ASSERT_GT(assembly.corrections.setpoint->size(), 0);
  const std::string name =
      assembly.machine.joints[0].name + "." + assembly.corrections.setpoint->budget(0).name;
  ASSERT_NE(table.find(name), nullptr) << name;
  SignalSampler sampler(table);
  CycleReport report;
  report.q_plan = report.q_setpoint = report.q_measured =
      JointVec::Zero(static_cast<Eigen::Index>(assembly.machine.joints.size()));
  report.corrections[0].offset = JointVec::Constant(report.q_plan.size(), 0.25);
  std::vector<double> row(table.columns());
  sampler.sample(report, row.data());
  EXPECT_EQ(table.find(name)->value(row.data()), 0.25);
}

}  // namespace
}  // namespace trn

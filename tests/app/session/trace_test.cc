#include "app/session/trace.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "core/axes.h"
#include "core/ports.h"
#include "kernel/rt_messages.h"
#include "tests/support/paths.h"

// What is written of reports made by hand.
namespace trn {
namespace {

using Row = std::map<std::string, std::string>;

class Trace : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }

  TraceWriter writer(bool pieces = false) {
    return TraceWriter(path_, assembly_.machine, *assembly_.map, *assembly_.corrections.setpoint, false,
                       pieces);
  }
  /// A period in which X stands at as many mm as its number.
  CycleReport report(std::uint64_t period, MotionState motion) const {
    CycleReport out;
    out.period = period;
    out.motion = motion;
    out.drives = DriveState::kEnabled;
    out.q_plan = out.q_setpoint = JointVec::Zero(3);
    out.q_plan[0] = out.q_setpoint[0] = static_cast<double>(period);
    out.line = motion == MotionState::kRest ? 0 : 7;
    return out;
  }
  static std::vector<std::string> fields(const std::string& line) {
    std::vector<std::string> out;
    std::istringstream in(line);
    for (std::string field; std::getline(in, field, ',');) out.push_back(field);
    return out;
  }
  /// By the header's names.
  std::vector<Row> rows() const {
    std::ifstream in(path_);
    std::string text;
    std::getline(in, text);
    const std::vector<std::string> names = fields(text);
    std::vector<Row> out;
    while (std::getline(in, text)) {
      const std::vector<std::string> values = fields(text);
      EXPECT_EQ(values.size(), names.size());
      out.emplace_back();
      for (std::size_t i = 0; i < std::min(values.size(), names.size()); ++i)
        out.back()[names[i]] = values[i];
    }
    return out;
  }
  static std::vector<std::string> column(const std::vector<Row>& rows, const std::string& name) {
    std::vector<std::string> out;
    for (const Row& row : rows) out.push_back(row.at(name));
    return out;
  }

  std::string path_ = fmt::format("{}trace_test_{}.csv", ::testing::TempDir(), getpid());
  Assembly assembly_ = assemble(source_dir() + "/configs/mill.toml");
};

// However long the machine stood before, the trace begins with the last period of that.
TEST_F(Trace, BeginsWithTheLastPeriodAtRest) {
  TraceWriter trace = writer();
  for (std::uint64_t period = 0; period < 10; ++period)
    trace.write(report(period, period < 8 ? MotionState::kRest : MotionState::kMoving));
  trace.close();
  EXPECT_EQ(column(rows(), "X"), (std::vector<std::string>{"7", "8", "9"}));
  EXPECT_EQ(column(rows(), "t_s"), (std::vector<std::string>{"0", "0.001", "0.002"}));
  EXPECT_EQ(column(rows(), "line"), (std::vector<std::string>{"0", "7", "7"}));
}

// Rows are a period apart, or whoever reads them takes them for missing ones.
TEST_F(Trace, RestsBetweenMotionsStandInIt) {
  TraceWriter trace = writer();
  using State = MotionState;
  const State states[] = {State::kRest, State::kMoving, State::kRest, State::kRest, State::kMoving};
  for (std::uint64_t period = 0; period < 5; ++period) trace.write(report(period, states[period]));
  trace.close();
  EXPECT_EQ(column(rows(), "X"), (std::vector<std::string>{"0", "1", "2", "3", "4"}));
}

TEST_F(Trace, EveryKindOfMotionBeginsIt) {
  for (const MotionState motion :
       {MotionState::kMoving, MotionState::kHeld, MotionState::kJogging, MotionState::kPaused}) {
    TraceWriter trace = writer();
    trace.write(report(0, MotionState::kRest));
    trace.write(report(1, motion));
    trace.close();
    EXPECT_EQ(rows().size(), 2u) << static_cast<int>(motion);
  }
  TraceWriter trace = writer();
  trace.write(report(0, MotionState::kRest));
  trace.write(report(1, MotionState::kHoming));
  trace.close();
  EXPECT_TRUE(rows().empty()) << "homing is the drives' own";
}

// The mill's table carries the work along Y, so the tip goes the other way in it; the tool is 50 mm long.
TEST_F(Trace, ShowsTheTipAndTheToolAxis) {
  TraceWriter trace = writer();
  CycleReport moving = report(3, MotionState::kMoving);
  moving.q_plan << 1.5, 2.25, 60;
  moving.q_setpoint << 1.625, 2.25, 60;  // with what the corrections add
  moving.context.tool_offset = {0, 0, 50};
  trace.write(moving);
  trace.close();
  const Row row = rows().at(0);
  EXPECT_EQ(row.at("X"), "1.625");
  const std::vector<std::pair<std::string, double>> expected = {{"p_x", 1.5}, {"p_y", -2.25}, {"p_z", 10},
                                                                {"u_i", 0},   {"u_j", 0},     {"u_k", 1}};
  for (const auto& [name, value] : expected) EXPECT_NEAR(std::stod(row.at(name)), value, 1e-12) << name;
}

TEST_F(Trace, ASetpointComesBackToTheLastBit) {
  TraceWriter trace = writer();
  CycleReport moving = report(0, MotionState::kMoving);
  moving.q_setpoint << 1.0 / 3, -1e-17 / 7, 123.45678901234567;
  trace.write(moving);
  trace.close();
  const Row row = rows().at(0);
  EXPECT_EQ(std::stod(row.at("X")), moving.q_setpoint[0]);
  EXPECT_EQ(std::stod(row.at("Y")), moving.q_setpoint[1]);
  EXPECT_EQ(std::stod(row.at("Z")), moving.q_setpoint[2]);
}

// One period repeats the last setpoints as a piece of its own, however long the power is gone; what follows
// is the next piece, at its own time.
TEST_F(Trace, PiecesAreCountedWhereThePowerWasGone) {
  TraceWriter trace = writer(true);
  trace.power_lost();  // before the first motion nothing is lost
  trace.write(report(0, MotionState::kRest));
  trace.write(report(1, MotionState::kMoving));
  trace.write(report(2, MotionState::kMoving));
  for (int i = 0; i < 5; ++i) trace.power_lost();
  trace.write(report(9, MotionState::kRest));
  trace.write(report(10, MotionState::kMoving));
  trace.close();
  EXPECT_EQ(column(rows(), "piece"), (std::vector<std::string>{"0", "0", "0", "1", "2", "2"}));
  EXPECT_EQ(column(rows(), "X"), (std::vector<std::string>{"0", "1", "2", "2", "9", "10"}));
  const auto times = column(rows(), "t_s");
  const double expected_s[] = {0, 0.001, 0.002, 0.003, 0.009, 0.01};
  for (std::size_t i = 0; i < times.size(); ++i) EXPECT_NEAR(std::stod(times[i]), expected_s[i], 1e-15);
}

TEST_F(Trace, WhatCannotBeWrittenIsTold) {
  EXPECT_THROW(
      TraceWriter("/nonexistent/t.csv", assembly_.machine, *assembly_.map, *assembly_.corrections.setpoint),
      std::runtime_error);
  TraceWriter full("/dev/full", assembly_.machine, *assembly_.map, *assembly_.corrections.setpoint);
  full.write(report(0, MotionState::kMoving));
  EXPECT_THROW(full.close(), std::runtime_error);
}

}  // namespace
}  // namespace trn

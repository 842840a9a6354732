#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "app/check/limit_judge.h"
#include "app/check/trace_check.h"
#include "app/check/trace_reader.h"
#include "core/axes.h"
#include "core/machine.h"

// Traces with peaks known in closed form, judged by the checker. For q(t) = R sin(w t) sampled at t = k h the
// n-th backward difference over h^n is R (2 sin(w h / 2) / h)^n times a sine, so its peak is known exactly.
namespace trn {
namespace {

constexpr double kStep = 0.001;

Machine machine() {
  Machine made{parse_config("", "none"), "bench", kStep, {}};
  made.joints.push_back({"X", JointKind::kLinear, {-100, 100, 50, 500, 6000}});
  made.joints.push_back({"A", JointKind::kRotary, {-1, 2, 1, 10, 200}});
  return made;
}

class CheckTrace : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::path(::testing::TempDir()) /
            fmt::format("check_{}.csv", ::testing::UnitTest::GetInstance()->current_test_info()->name());
  }
  void TearDown() override { std::filesystem::remove(path_); }

  void write(const std::string& text) { std::ofstream(path_, std::ios::binary) << text; }

  // Rows at k * step for k in [0, count), X = x(t), A = a(t), line = 1 + k / 10.
  template <typename X, typename A>
  void write_trace(int count, X x, A a, double step = kStep, const char* format = "{:.17g}") {
    std::string text = "t_s,X,A,p_x,line\n";
    for (int k = 0; k < count; ++k) {
      const double t = k * step;
      text += fmt::format("{:.17g},", t) + fmt::format(fmt::runtime(format), x(t)) + "," +
              fmt::format(fmt::runtime(format), a(t)) + fmt::format(",0,{}\n", 1 + k / 10);
    }
    write(text);
  }

  TraceVerdict check() {
    return check_trace(path_.string(), machine(), [](std::uint64_t) {});
  }

  std::string failure() {
    try {
      check();
    } catch (const TraceError& error) {
      return std::string(error.what()).substr(path_.string().size());
    }
    return "no error";
  }

  std::filesystem::path path_;
};

double zero(double) { return 0; }

// A rest-to-rest motion over T whose derivatives to the third vanish at both ends: D u^4 (35 - 84u + 70u^2 -
// 20u^3).
double smooth_step(double t, double distance, double duration) {
  const double u = std::clamp(t / duration, 0.0, 1.0);
  return distance * u * u * u * u * (35 + u * (-84 + u * (70 - 20 * u)));
}

// A sine that swells from rest over 40 s, stands for 2 s and fades again: so slowly that the sine alone sets
// the peaks, to 1e-4.
double swelling_sine(double t, double amplitude, double w) {
  return amplitude * std::sin(w * t) * (smooth_step(t, 1, 40) - smooth_step(t - 42, 1, 40));
}

TEST_F(CheckTrace, SinePeaksAreThoseOfTheClosedForm) {
  const double w = 7.0, amplitude = 0.9;
  write_trace(
      82001, [&](double t) { return swelling_sine(t, amplitude, w); }, zero);
  const TraceVerdict verdict = check();
  const JointVerdict& x = verdict.joints[0];
  const double factor = 2 * std::sin(w * kStep / 2) / kStep;
  const auto expect_peak = [&](Quantity quantity, double ratio) {
    EXPECT_NEAR(x.peak(quantity).ratio, ratio, 1e-4 * ratio) << to_string(quantity);
  };
  expect_peak(Quantity::kPosition, amplitude / 100);
  expect_peak(Quantity::kVelocity, amplitude * factor / 50);
  expect_peak(Quantity::kAcceleration, amplitude * factor * factor / 500);
  expect_peak(Quantity::kJerk, amplitude * std::pow(factor, 3) / 6000);
  EXPECT_TRUE(verdict.within_limits);
  EXPECT_EQ(verdict.joints[1].peak(Quantity::kJerk).ratio, 0);
  EXPECT_EQ(verdict.rows, 82001u);
}

TEST_F(CheckTrace, CubicHasTheJerkOfItsCoefficient) {
  // Constant jerk J from rest: the third difference of J t^3 / 6 is J h^3 exactly.
  const double jerk = 5999.0;
  write_trace(
      60, [&](double t) { return jerk * t * t * t / 6; }, zero);
  const Peak inside = [&] {  // the sudden stop at the end is a violation of its own; look at the inner rows
    LimitJudge judge(machine().joints, kStep);
    for (int k = 0; k < 60; ++k)
      judge.row({k * kStep, {jerk * std::pow(k * kStep, 3) / 6, 0}, {{17, 17}, {17, 17}}, 1});
    return judge.verdicts()[0].peak(Quantity::kJerk);
  }();
  EXPECT_NEAR(inside.ratio, jerk / 6000, 1e-6);
  const TraceVerdict verdict = check();
  EXPECT_FALSE(verdict.within_limits);
  EXPECT_GT(verdict.joints[0].peak(Quantity::kJerk).ratio, 100);
  EXPECT_NEAR(verdict.joints[0].peak(Quantity::kJerk).t_s, 60 * kStep, 1e-9)
      << "the jump to rest comes after the last row";
}

// Each limit in turn broken by 2e-6 of it must be found, and 0.5e-6 must pass, with the right place.
TEST_F(CheckTrace, VerdictTurnsAtOneMillionth) {
  // One step of the position by a single quantum, far below every other limit: velocity alone.
  for (const double factor : {1.0 + 0.5e-6, 1.0 + 2e-6}) {
    const bool legal = factor < LimitJudge::kRatioMax;
    Machine bench = machine();
    bench.joints[0].limit = {-1e3, 1e3, 50, 1e12, 1e12};
    LimitJudge velocity(bench.joints, kStep);
    for (int k = 0; k < 10; ++k)
      velocity.row({k * kStep, {std::min(k, 4) * 50e-3 * factor, 0}, {{17, 17}, {17, 17}}, 7});
    velocity.finish();
    EXPECT_EQ(velocity.within_limits(), legal);
    bench.joints[0].limit = {-1e3, 1e3, 1e12, 500, 1e12};
    LimitJudge acceleration(bench.joints, kStep);
    for (int k = 0; k < 10; ++k)
      acceleration.row({k * kStep, {k < 5 ? 0 : 500e-6 * factor, 0}, {{17, 17}, {17, 17}}, 7});
    acceleration.finish();
    EXPECT_EQ(acceleration.within_limits(), legal);
    bench.joints[0].limit = {-2, 2, 1e12, 1e12, 1e12};
    LimitJudge position(bench.joints, kStep);
    for (int k = 0; k < 10; ++k)
      position.row({k * kStep, {k == 5 ? -2 * factor : 0, 0}, {{17, 17}, {17, 17}}, 7});
    position.finish();
    EXPECT_EQ(position.within_limits(), legal);
    EXPECT_EQ(position.verdicts()[0].peak(Quantity::kPosition).over, legal ? 0u : 1u);
  }
}

TEST_F(CheckTrace, PositionIsJudgedAgainstItsOwnEnd) {
  // A lies in [-1, 2]: 1.6 is 1.1 of the half range 1.5 from the middle 0.5; ratio 0.7333.
  write_trace(5001, zero, [](double t) { return smooth_step(t, 1.6, 5.0); });
  EXPECT_NEAR(check().joints[1].peak(Quantity::kPosition).ratio, 1.1 / 1.5, 1e-12);
  write_trace(6001, zero, [](double t) { return smooth_step(t, -1.05, 6.0); });
  const TraceVerdict verdict = check();
  EXPECT_FALSE(verdict.within_limits);
  EXPECT_NEAR(verdict.joints[1].peak(Quantity::kPosition).ratio, 1.55 / 1.5, 1e-12);
}

TEST_F(CheckTrace, PeakNamesTimeAndLine) {
  const auto bump = [](double t) { return std::abs(t - 0.123) < 1e-9 ? 0.2 : 0.0; };
  write_trace(300, bump, zero);
  const Peak peak = check().joints[0].peak(Quantity::kVelocity);
  EXPECT_NEAR(peak.value, 200, 1e-9);
  EXPECT_NEAR(peak.t_s, 0.123, 1e-12);
  EXPECT_EQ(peak.line, 13u);
  EXPECT_EQ(peak.over, 2u);
}

TEST_F(CheckTrace, DenserTraceIsJudgedByItsOwnStep) {
  const double w = 7.0;
  for (const double step : {kStep, kStep / 4, kStep / 10}) {
    write_trace(
        static_cast<int>(0.4 / step), [&](double t) { return 0.9 * std::sin(w * t); }, zero, step);
    const TraceVerdict verdict = check();
    EXPECT_EQ(verdict.step_s, step);
    const double factor = 2 * std::sin(w * step / 2) / step;
    EXPECT_NEAR(verdict.joints[0].peak(Quantity::kVelocity).ratio, 0.9 * factor / 50, 1e-5);
  }
}

TEST_F(CheckTrace, ResolutionOfTheDigitsIsReported) {
  const auto motion = [](double t) { return smooth_step(t, 90.0, 6.0); };
  write_trace(6001, motion, zero);
  TraceVerdict verdict = check();
  // 90 mm: one ulp is 2^-46; 8 halves of it over h^3, against 6000.
  EXPECT_NEAR(verdict.joints[0].peak(Quantity::kJerk).resolution_ratio, 4 * std::ldexp(1, -46) / 1e-9 / 6000,
              1e-15);
  EXPECT_TRUE(resolution_notes(verdict, machine().joints).empty());

  write_trace(6001, motion, zero, kStep, "{:.6f}");
  verdict = check();
  EXPECT_NEAR(verdict.joints[0].peak(Quantity::kJerk).resolution_ratio, 4e-6 / 1e-9 / 6000, 1e-9);
  const auto notes = resolution_notes(verdict, machine().joints);
  ASSERT_FALSE(notes.empty());
  EXPECT_NE(notes.back().find("X jerk"), std::string::npos);

  write_trace(6001, motion, zero, kStep, "{:.5g}");
  verdict = check();
  EXPECT_NEAR(verdict.joints[0].peak(Quantity::kJerk).resolution_ratio, 4e-3 / 1e-9 / 6000, 1e-6);
  EXPECT_NE(resolution_notes(verdict, machine().joints).back().find("meaningless"), std::string::npos);
}

TEST_F(CheckTrace, DamageIsNamedByLineAndColumn) {
  const std::string header = "t_s,X,A,line\n";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", ":1:1: the trace is empty; a header row is expected"},
      {header, ":1:1: the trace has a header but no rows"},
      {"X,t_s,A\n", ":1:1: column 1 must be 't_s', and no other; here stands 'X'"},
      {"t_s,X,X,A\n", ":1:7: two columns are named 'X'"},
      {"t_s,X,line\n", ":1:1: no column for joint 'A'; the header must name it"},
      {header + "0,1,2,3\n0.001,1,2\n", ":3:9: this row does not have the 4 fields of the header"},
      {header + "0,1,2,3,4\n", ":2:7: this row does not have the 4 fields of the header"},
      {header + "0,1,2,3\n0.001,1,x7,3\n", ":3:9: 'x7' is not a finite number"},
      {header + "0,1,2,3\n0.001,1,,3\n", ":3:9: '' is not a finite number"},
      {header + "0,nan,2,3\n", ":2:3: 'nan' is not a finite number"},
      {header + "0,1,inf,3\n", ":2:5: 'inf' is not a finite number"},
      {header + "0,1,2,3\n0.001,1,2,3", ":3:1: the trace was cut off here: this row has no line end"},
      {header + "0,1,2,3\n0.001,1,2,3\n0.003,1,2,3\n",
       ":4:1: rows are missing or out of order: 0.003 s follows 0.001 s, the step is 0.001 s"},
      {header + "0,1,2,3\n0,1,2,3\n", ":3:1: time does not advance: 0 s follows 0 s"},
      {header + "0,1,2,3\n0.002,1,2,3\n",
       ":3:1: rows are 0.002 s apart, but the machine's period is 0.001 s: peaks would be missed"},
      {header + "0,1,2,3\n\n", ":3:1: this row does not have the 4 fields of the header"},
      {header + std::string(100000, '1') + "\n", ":2:1: a row of more than 65536 bytes: this is not a trace"},
      {std::string("\x7f"
                   "ELF\0\1\2",
                   7) +
           "\n",
       ":1:1: column 1 must be 't_s', and no other; here stands '\\x7fELF\\x00\\x01\\x02'"},
  };
  for (const auto& [text, message] : cases) {
    write(text);
    EXPECT_EQ(failure(), message);
  }
}

// A daemon's recording in which an emergency stop took the power in motion, and a reset gave it back
// elsewhere.
TEST_F(CheckTrace, PiecesAreJudgedByThemselves) {
  std::string text = "t_s,X,A,line,piece\n";
  const auto add = [&](int k, double x, int piece) {
    text += fmt::format("{:.17g},{:.17g},0,1,{}\n", k * kStep, x, piece);
  };
  for (int k = 0; k < 80; ++k) add(k, 1000 * std::pow(k * kStep, 3), 0);  // jerk 6000 exactly
  add(80, 1000 * std::pow(79 * kStep, 3), 1);
  for (int k = 5000; k < 5100; ++k) add(k, 7, 2);
  write(text);
  const TraceVerdict verdict = check();
  EXPECT_EQ(verdict.pieces, 3u);
  EXPECT_EQ(verdict.rows, 181u);
  EXPECT_TRUE(verdict.within_limits);
  EXPECT_NEAR(verdict.joints[0].peak(Quantity::kJerk).ratio, 1, 1e-6);
  add(5100, 7.2, 2);  // inside a piece nothing is forgiven: neither a jump
  add(5101, 7.2, 2);
  write(text);
  EXPECT_FALSE(check().within_limits);
  add(5103, 7.2, 2);  // nor a row that is missing
  write(text);
  EXPECT_NE(failure().find("rows are missing or out of order"), std::string::npos);
}

TEST_F(CheckTrace, PiecesOutOfOrderAreDamage) {
  const std::string header = "t_s,X,A,piece\n";
  write(header + "0,1,1,0\n0.001,1,1,0\n0.001,1,1,1\n");
  EXPECT_EQ(failure(), ":4:1: pieces are out of order: piece 1 at 0.001 s follows piece 0 at 0.001 s");
  write(header + "0,1,1,5\n0.001,1,1,4\n");
  EXPECT_EQ(failure(), ":3:1: pieces are out of order: piece 4 at 0.001 s follows piece 5 at 0 s");
}

TEST_F(CheckTrace, WindowsLineEndsAreRead) {
  write("t_s,X,A,line\r\n0,1,1,3\r\n0.001,1,1,3\r\n");
  EXPECT_TRUE(check().within_limits);
}

TEST_F(CheckTrace, RowsAcrossTheReadBufferAreWhole) {
  // 3 MB of rows: the buffer's edge falls inside a row many times over.
  write_trace(
      60000, [](double t) { return smooth_step(t, 90.0, 60.0); }, [](double t) { return 1e-3 * t; });
  const TraceVerdict verdict = check();
  EXPECT_EQ(verdict.rows, 60000u);
  EXPECT_NEAR(verdict.joints[0].peak(Quantity::kVelocity).ratio, 90.0 / 60 * 2.1875 / 50, 1e-6);
}

TEST_F(CheckTrace, JsonCarriesTheVerdict) {
  write_trace(
      5001, [](double t) { return smooth_step(t, 10, 5.0); }, zero);
  const auto json = nlohmann::json::parse(verdict_json(check(), machine(), "t.csv"));
  EXPECT_TRUE(json["within_limits"].get<bool>());
  EXPECT_EQ(json["joints"][1]["name"], "A");
  EXPECT_EQ(json["joints"][1]["unit"], "rad");
  EXPECT_EQ(json["joints"][0]["limits"]["jerk"], 6000);
  EXPECT_NEAR(json["joints"][0]["ratios"]["velocity"].get<double>(), 10.0 / 5 * 2.1875 / 50, 1e-6);
}

}  // namespace
}  // namespace trn

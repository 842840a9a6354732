#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "app/check/limit_judge.h"
#include "app/check/trace_check.h"
#include "core/axes.h"
#include "core/machine.h"

// What people read of a verdict made by hand.
namespace trn {
namespace {

class Report : public ::testing::Test {
 protected:
  void SetUp() override {
    machine_.joints.push_back({"X", JointKind::kLinear, {-100, 300, 50, 500, 6000}});
    machine_.joints.push_back({"A", JointKind::kRotary, {-1, 2, 1, 10, 200}});
    verdict_.step_s = 0.001;
    verdict_.duration_s = 1.5;
    verdict_.rows = 1501;
    verdict_.within_limits = true;
    verdict_.joints.resize(2);
  }
  Peak& peak(std::size_t joint, Quantity quantity) {
    return verdict_.joints[joint].peaks[static_cast<std::size_t>(quantity)];
  }
  std::string table() const { return verdict_table(verdict_, machine_, "t.csv"); }
  // The words of the row of a joint's quantity, one blank apart.
  std::string row(const std::string& joint, const std::string& quantity) const {
    std::istringstream lines(table());
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      std::string first, second, out;
      if (!(words >> first >> second) || first != joint || second != quantity) continue;
      for (std::string word; words >> word;) out += (out.empty() ? "" : " ") + word;
      return out;
    }
    return "no such row";
  }
  bool says(const std::string& text) const { return table().find(text) != std::string::npos; }

  Machine machine_{parse_config("", "none"), "bench", 0.001, {}};
  TraceVerdict verdict_;
};

TEST_F(Report, SaysWhatWasJudged) {
  EXPECT_EQ(table().substr(0, table().find('\n')),
            "t.csv: 1501 rows, 1.500000 s, step 0.001 s, machine 'bench' (period 0.001 s)");
}

TEST_F(Report, OnlyARecordingInPiecesNamesThem) {
  EXPECT_FALSE(says("pieces"));
  verdict_.pieces = 2;
  EXPECT_TRUE(says("\n2 pieces, each judged by itself: between them the drives had no power\n"));
}

TEST_F(Report, ARowHasValueLimitRatioAndPlace) {
  peak(0, Quantity::kVelocity) = {-45, 0.9, 0.25, 12, 0, 3e-9};
  EXPECT_EQ(row("X", "velocity"), "-45 50 mm/s 0.90000000 0.250000 12 3.0e-09");
  peak(0, Quantity::kJerk) = {-6600, 1.1, 0.5, 13, 4, 0};
  EXPECT_EQ(row("X", "jerk"), "-6600 6000 mm/s3 1.10000000 0.500000 13 0.0e+00 OVER in 4 rows");
}

TEST_F(Report, RotaryJointsAreShownInDegrees) {
  peak(1, Quantity::kAcceleration) = {5, 0.5, 0.25, 2, 0, 0};  // rad/s2; a radian has 57.29578 deg
  EXPECT_EQ(row("A", "acceleration"), "286.479 572.958 deg/s2 0.50000000 0.250000 2 0.0e+00");
}

// X goes from -100 to 300: 99 lies below the middle, so the lower end is the one it comes near.
TEST_F(Report, APositionStandsBesideItsNearerEnd) {
  peak(0, Quantity::kPosition).value = 99;
  EXPECT_EQ(row("X", "position").substr(0, 10), "99 -100 mm");
  peak(0, Quantity::kPosition).value = 101;
  EXPECT_EQ(row("X", "position").substr(0, 10), "101 300 mm");
}

TEST_F(Report, TheVerdictIsTheLastLine) {
  const std::string good = "\nwithin limits: every ratio <= 1.000001\n";
  const std::string bad = "\nLIMITS BROKEN: a ratio is over 1.000001\n";
  EXPECT_TRUE(table().ends_with(good));
  verdict_.within_limits = false;
  EXPECT_TRUE(table().ends_with(bad));
}

// A ratio is decided to 1e-6; digits that resolve less make it doubtful, and meaningless where they are all
// of it.
TEST_F(Report, DoubtfulDigitsAreNoted) {
  peak(0, Quantity::kVelocity).ratio = 0.5;
  peak(0, Quantity::kJerk) = {3000, 0.5, 0, 0, 0, 0.9e-6};
  EXPECT_TRUE(resolution_notes(verdict_, machine_.joints).empty());
  peak(0, Quantity::kJerk).resolution_ratio = 0.1;
  auto notes = resolution_notes(verdict_, machine_.joints);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_EQ(notes[0],
            "X jerk: the recorded digits resolve this ratio only to 1.0e-01; "
            "a ratio that near to 1 is not decided by this trace");
  EXPECT_TRUE(says("note: " + notes[0] + "\n"));
  for (const double all : {0.6, 1.5}) {
    peak(0, Quantity::kJerk).resolution_ratio = all;
    notes = resolution_notes(verdict_, machine_.joints);
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("meaningless"), std::string::npos) << notes[0];
  }
  peak(0, Quantity::kJerk) = {9000, 1.5, 0, 0, 0, 1.2};
  EXPECT_NE(resolution_notes(verdict_, machine_.joints)[0].find("meaningless"), std::string::npos);
  peak(0, Quantity::kVelocity).ratio = 0;  // a joint that never moved has no difference to resolve
  EXPECT_TRUE(resolution_notes(verdict_, machine_.joints).empty());
}

}  // namespace
}  // namespace trn

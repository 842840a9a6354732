#include "interp/plan/speed/window_planner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "core/axes.h"
#include "core/path.h"
#include "tests/interp/plan/speed_support.h"

// A straight way from rest to rest, against the S-curve in closed form.
namespace trn::speed_test {
namespace {

/// Along X through these places, at most 400 mm/s.
Planned drive_through(const std::vector<double>& places) {
  std::vector<PathPiece> pieces;
  for (size_t i = 0; i + 1 < places.size(); ++i) {
    Words a = Words::Zero(), b = Words::Zero();
    a[kX] = places[i];
    b[kX] = places[i + 1];
    pieces.push_back(make_line(a, b));
  }
  return run(pieces, linear_joints(2), IdentityMap({kX, kY}), 400, full_shares());
}

std::vector<double> even(double from, double to, int parts) {
  std::vector<double> out;
  for (int i = 0; i <= parts; ++i) out.push_back(from + (to - from) * i / parts);
  return out;
}

TEST(WindowPlanner, ALineTakesAsLongHoweverItIsCut) {
  const double optimum = s_curve_time(60, 400, 5000, 100000);
  std::vector<std::vector<double>> ways = {{0, 60}, even(0, 60, 60)};
  ways.push_back(even(0, 1, 100));
  ways.back().push_back(60);  // short pieces at the start
  for (size_t i = 0, n = ways.size(); i < n; ++i) {
    std::vector<double> back = ways[i];
    for (double& place : back) place = 60 - place;
    std::reverse(back.begin(), back.end());
    ways.push_back(back);
  }
  for (const auto& places : ways) {
    const Planned planned = drive_through(places);
    const Verdict verdict = judge(planned.blocks, IdentityMap({kX, kY}), linear_joints(2), 2.5e-4);
    EXPECT_LT(planned.stats.time_s, 1.02 * optimum)
        << places.size() << " places, the second at " << places[1];
    EXPECT_LE(verdict.jerk, 1);
    EXPECT_TRUE(verdict.ends_well);
  }
}

}  // namespace
}  // namespace trn::speed_test

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "interp/plan/speed/sample_stretch.h"
#include "tests/interp/plan/speed_support.h"

// The planner against certified optimal times of the same joint paths. The times were computed once by an
// independent solver from the files that TRN_EXPORT writes (tests/interp/plan/speed_reference.py runs it).
namespace trn::speed_test {
namespace {

struct Case {
  std::string name;
  std::vector<PathPiece> pieces;
  Joints joints;
  const JointMap* map;
  double feed;
  double best_s;  ///< feasible optimum found by the reference
  double step = 0.02;
};

std::vector<PathPiece> sine(double amplitude, double wave, double length, double size) {
  const auto point = [&](double s) {
    PathPoint p;
    p.y = p.d1 = p.d2 = p.d3 = Words::Zero();
    const double w = 2 * kPi / wave;
    p.y << s, amplitude * std::sin(w * s), 0, 0, 0, 0;
    p.d1 << 1, amplitude * w * std::cos(w * s), 0, 0, 0, 0;
    p.d2 << 0, -amplitude * w * w * std::sin(w * s), 0, 0, 0, 0;
    p.d3 << 0, -amplitude * w * w * w * std::cos(w * s), 0, 0, 0, 0;
    return p;
  };
  std::vector<PathPiece> out;
  for (int i = 0; i < static_cast<int>(length / size + 0.5); ++i)
    out.push_back(make_hermite(point(i * size), point((i + 1) * size), size));
  return out;
}

std::vector<PathPiece> corner() {
  Words a = Words::Zero(), b = a, c = a;
  b[kX] = 50;
  c.head<2>() << 50, 50;
  return blended({a, b, c}, 0.12);
}

std::vector<PathPiece> polyline(unsigned seed, int count, double step, double turn, double reach) {
  std::mt19937_64 rng(seed);
  return blended(random_vertices(rng, count, step, turn), reach);
}

std::vector<Case> cases() {
  static const IdentityMap x({kX}), xy({kX, kY}), xyz({kX, kY, kZ});
  static const TrunnionMap trunnion;
  Words to = Words::Zero();
  to[kX] = 100;
  return {
      {"line", {make_line(Words::Zero(), to)}, linear_joints(1), &x, 200, 0.58949, 0.05},
      {"circle", circle(20, 1), linear_joints(2), &xy, 150, 0.91583},
      {"corner", corner(), linear_joints(2), &xy, 1e9, 0.50627, 0.005},
      {"sine", sine(3, 15, 60, 0.5), linear_joints(2), &xy, 300, 0.79971},
      {"polyline", polyline(21, 12, 5, 0, 0.5), linear_joints(3), &xyz, 150, 1.05495},
      {"five_axis", polyline(22, 12, 5, 0.08, 1.0), cradle_joints(), &trunnion, 100, 1.9245},
      {"five_axis_short", polyline(23, 60, 0.5, 0.004, 0.2), cradle_joints(), &trunnion, 100, 2.93637},
  };
}

void export_case(const Case& c, const std::string& folder) {
  std::vector<PlanPiece> stretch;
  for (const PathPiece& piece : c.pieces) stretch.push_back(plan(piece, c.feed));
  std::ofstream csv(folder + "/" + c.name + ".csv");
  StretchWriter(csv, c.joints).write(stretch, *c.map, c.step);
  nlohmann::json limits;
  for (const Joint& j : c.joints)
    limits["joints"].push_back(
        {{"name", j.name}, {"v", j.limit.velocity}, {"a", j.limit.acceleration}, {"j", j.limit.jerk}});
  if (c.feed < 1e6) limits["feed"] = c.feed;
  std::ofstream(folder + "/" + c.name + ".json") << limits;
}

TEST(SpeedOptimality, WithinThreePercentOfTheBestMotion) {
  const char* folder = std::getenv("TRN_EXPORT");
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    if (folder) export_case(c, folder);
    const Planned r = run(c.pieces, c.joints, *c.map, c.feed, full_shares());
    std::printf("%-16s %.5f s, best %.5f s, ratio %.4f\n", c.name.c_str(), r.stats.time_s, c.best_s,
                r.stats.time_s / c.best_s);
    EXPECT_LE(r.stats.time_s, 1.03 * c.best_s);
    EXPECT_GE(r.stats.time_s, 0.995 * c.best_s);
    const Verdict v = judge(r.blocks, *c.map, c.joints, 1e-4, c.feed);
    EXPECT_LE(std::max({v.velocity, v.acceleration, v.jerk, v.feed}), 1.000001);
  }
}

TEST(SampleStretch, RowsBeginAtZeroAndEndWithThePath) {
  const Case c = cases()[4];
  std::vector<PlanPiece> stretch;
  double length = 0;
  for (const PathPiece& piece : c.pieces) {
    stretch.push_back(plan(piece, c.feed));
    length += piece.length;
  }
  double last = -1, last_tip = -1;
  JointVec end;
  sample_stretch(stretch, *c.map, 0.05, [&](double s, const JointVec& q, double tip) {
    if (last < 0) {
      EXPECT_EQ(s, 0);
    } else {
      EXPECT_LE(s - last, 0.05 + 1e-12);
    }
    EXPECT_GT(s, last);
    EXPECT_GT(tip, last_tip);
    last = s;
    last_tip = tip;
    end = q;
  });
  EXPECT_NEAR(last, length, 1e-9);
  JointVec want;
  c.map->map(c.pieces.back().at(c.pieces.back().length), {}, want);
  EXPECT_LT((end - want).norm(), 1e-12);
}

}  // namespace
}  // namespace trn::speed_test

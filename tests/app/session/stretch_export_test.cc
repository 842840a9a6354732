#include "app/session/stretch_export.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/frames.h"
#include "tests/interp/plan/optimal_cases.h"
#include "tests/interp/plan/speed_support.h"

namespace trn::speed_test {
namespace {

void export_case(const OptimalCase& c, const std::string& folder) {
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

// Not a test of its own: with TRN_EXPORT=FOLDER it writes what speed_reference.py reads.
TEST(StretchExport, WritesTheOptimalCasesWhereAskedTo) {
  const char* folder = std::getenv("TRN_EXPORT");
  if (folder == nullptr) GTEST_SKIP() << "TRN_EXPORT is not set";
  for (const OptimalCase& c : optimal_cases()) export_case(c, folder);
}

TEST(StretchExport, RowsBeginAtZeroAndEndWithThePath) {
  const OptimalCase c = optimal_cases()[4];
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

// A helix of radius 10 and pitch 2 pi * 3 has the length sqrt(10^2 + 3^2) a radian.
TEST(StretchExport, TipLengthOfAHelixIsTheClosedForm) {
  Words from = Words::Zero(), to = Words::Zero();
  from[kX] = to[kX] = 10;
  to[kZ] = 3 * 2 * kPi;
  const PathPiece helix = make_arc(from, to, Vec3(0, 0, 0), Vec3(0, 0, 1), 2 * kPi);
  EXPECT_NEAR(tip_length(helix), 2 * kPi * std::hypot(10, 3), 1e-9);
}

// Straight along X as the fourth power of the parameter: the speed is far from even, the length that of the
// ends.
TEST(StretchExport, TipLengthOfAStraightPolynomialIsTheDistanceOfItsEnds) {
  PathPiece piece;
  piece.kind = PathPiece::Kind::kPolynomial;
  piece.length = 2;
  for (Words& c : piece.c) c.setZero();
  piece.c[4][kX] = 7;
  EXPECT_NEAR(tip_length(piece), 7, 1e-12);
}

TEST(StretchExport, WriterSeparatesStretchesByABlankLine) {
  const Joints joints = linear_joints(1);
  const IdentityMap map({kX});
  Words to = Words::Zero();
  to[kX] = 1;
  const std::vector<PlanPiece> stretch{plan(make_line(Words::Zero(), to), 100)};
  std::ostringstream out;
  StretchWriter writer(out, joints);
  writer.write(stretch, map, 16);
  writer.write(stretch, map, 16);
  EXPECT_EQ(out.str(), "s,X,tip\n0,0,0\n1,1,1\n\n0,0,0\n1,1,1\n");
}

}  // namespace
}  // namespace trn::speed_test

#include <fmt/format.h>

#include <random>

#include "core/units.h"
#include "interp/gcode/plane_curve.h"
#include "tests/interp/gcode/run_program.h"

// Gouges of the compensated contour, near and far; distances of curves against dense samples of them.
namespace trn {
namespace {

using test::Session;
using Point = PlaneCurve::Point;

std::vector<Point> samples(const PlaneCurve& curve, int count) {
  std::vector<Point> points;
  const double sweep =
      curve.turn == 0 ? 0 : curve.turn * sweep_of(curve.centre, curve.from, curve.to, curve.turn);
  for (int i = 0; i <= count; ++i) {
    const double t = static_cast<double>(i) / count;
    if (curve.turn == 0)
      points.push_back(curve.from + t * (curve.to - curve.from));
    else
      points.push_back(curve.centre + Eigen::Rotation2Dd(sweep * t) * (curve.from - curve.centre));
  }
  return points;
}

double sampled_distance(const PlaneCurve& one, const PlaneCurve& two, int count) {
  double least = 1e300;
  for (const Point& p : samples(one, count))
    for (const Point& q : samples(two, count)) least = std::min(least, (p - q).norm());
  return least;
}

PlaneCurve random_curve(std::mt19937& rng) {
  std::uniform_real_distribution<double> place(-5, 5), angle(0.1, 6.2), size(0.5, 4);
  std::uniform_int_distribution<int> kind(-1, 1);
  PlaneCurve curve;
  curve.from = {place(rng), place(rng)};
  curve.to = {place(rng), place(rng)};
  curve.turn = kind(rng);
  if (curve.turn == 0) return curve;
  const double start = angle(rng);
  curve.centre = curve.from - size(rng) * Point(std::cos(start), std::sin(start));
  curve.to = curve.centre + Eigen::Rotation2Dd(curve.turn * angle(rng)) * (curve.from - curve.centre);
  return curve;
}

TEST(PlaneCurve, DistancesAreThoseOfDenseSamples) {
  std::mt19937 rng(7);
  for (int i = 0; i < 400; ++i) {
    const PlaneCurve one = random_curve(rng), two = random_curve(rng);
    const int count = 400;
    const double spacing = 25.0 / count;  // the longest arc's
    const double exact = distance(one, two), sampled = sampled_distance(one, two, count);
    EXPECT_LE(exact, sampled + 1e-12) << i;
    EXPECT_GE(exact, sampled - spacing) << i;
  }
}

TEST(PlaneCurve, TheBoxHoldsTheCurveAndTouchesIt) {
  std::mt19937 rng(8);
  for (int i = 0; i < 300; ++i) {
    const PlaneCurve curve = random_curve(rng);
    PlaneBox sampled;
    for (const Point& p : samples(curve, 2000)) sampled.extend(p);
    const PlaneBox box = box_of(curve);
    EXPECT_LE((box.min() - sampled.min()).cwiseAbs().maxCoeff(), 1e-4) << i;
    EXPECT_LE((box.max() - sampled.max()).cwiseAbs().maxCoeff(), 1e-4) << i;
  }
}

std::string fine_line(double x0, double y0, double x1, double y1, int parts) {
  std::string text;
  for (int i = 1; i <= parts; ++i)
    text += fmt::format("X{:.4f} Y{:.4f}\n", x0 + (x1 - x0) * i / parts, y0 + (y1 - y0) * i / parts);
  return text;
}

// A slot narrower than the tool, its walls 2000 moves apart along the contour.
TEST(Gouge, WallsFarApartAlongTheContourAreSeen) {
  const auto channel = [](double width) {  // tool on the left, between the walls
    return Session().error("F100 G0 X-20 Y-10\nG41 D1 G1 X0 Y0\n" + fine_line(0, 0, 100, 0, 1000) +
                           "G3 X100 Y40 J20\nG1 X60\n" + fmt::format("Y{}\n", width) +
                           fine_line(60, width, 0, width, 600) + "G40 X-20\n");
  };
  EXPECT_EQ(channel(6.1), "");
  const std::string gouge = channel(5.9);
  EXPECT_NE(gouge.find("gouge"), std::string::npos) << gouge;
  EXPECT_NE(gouge.find("line"), std::string::npos);
}

TEST(Gouge, BothLinesAreNamed) {
  const std::string error =
      Session().error("F100 G0 X-20 Y-10\nG41 D1 G1 X0 Y0\nX50\nY30\nX20\nY5\nX-30\nG40 X-40\n");
  EXPECT_NE(error.find("of line 6"), std::string::npos) << error;
  EXPECT_NE(error.find("line 3"), std::string::npos) << error;
}

TEST(Gouge, AContourThatClosesMayBeFollowedByAnotherInside) {
  // concentric squares, the tool inside, linked by feeds: the second widens the first
  EXPECT_EQ(Session().error("F100 G0 X0 Y0\nG41 D1 G1 X10 Y0\nY10\nX-10\nY-10\nX10\nY0\n"
                            "G1 X15\nY15\nX-15\nY-15\nX15\nY0\nG40 X0\n"),
            "");
}

TEST(Gouge, AnotherDepthIsAnotherContour) {
  EXPECT_EQ(Session().error("F100 G0 X0 Y0\nG41 D1 G1 X20 Y0\nY20\nX-20\nG1 Z-2\nX-20 Y-20\nX10\nY12\nX-10\n"
                            "G40 X0 Y0\n"),
            "");
}

TEST(Gouge, AThinRibMayBeCutFromBothSides) {
  EXPECT_EQ(Session().error("F100 G0 X-20 Y-10\nG42 D1 G1 X0 Y0\nX50\nY0.5\nX0\nG40 X-20 Y10\n"), "");
}

// A wall that is an arc, met by a line after many moves: by less than a sample of the arc would show.
TEST(Gouge, ArcsAreMeasuredExactly) {
  const auto program = [](double y) {
    return fmt::format(
        "F100 G0 X-120 Y-20\nG41 D1 G1 X-100 Y0\nG2 X100 Y0 I100\nG1 X140\nY200\nX-60\nY{0:.4f}\nX60\nY150\n"
        "G40 X0\n",
        100 + y);
  };
  EXPECT_EQ(Session().error(program(6.01)), "");
  EXPECT_NE(Session().error(program(5.95)), "");
}

}  // namespace
}  // namespace trn

#include <fmt/format.h>

#include <random>

#include "core/units.h"
#include "interp/gcode/cutter/plane_curve.h"
#include "interp/gcode/interpreter.h"
#include "interp/gcode/program_config.h"
#include "tests/interp/gcode/run_program.h"

// Gouges of the compensated contour, near and far; distances of curves against dense samples of them.
namespace trn {
namespace {

using test::CanonText;
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

// Where two curves meet lies on both of them, and what is near to both is told.
TEST(PlaneCurve, MeetingsAreWhereSamplesComeTogether) {
  std::mt19937 rng(9);
  for (int i = 0; i < 400; ++i) {
    const PlaneCurve one = random_curve(rng), two = random_curve(rng);
    const Meetings meets = meetings(one, two, 1e-6);
    for (std::size_t k = 0; k < meets.count; ++k)
      EXPECT_LE((point_at(one, meets.at[k].one) - point_at(two, meets.at[k].two)).norm(), 3e-6) << i;
    EXPECT_EQ(meets.count > 0, distance(one, two) < 1e-9) << i;
  }
}

TEST(PlaneCurve, AreaLengthAndPiecesAreThoseOfSamples) {
  std::mt19937 rng(10);
  for (int i = 0; i < 200; ++i) {
    const PlaneCurve curve = random_curve(rng);
    double area = 0, length = 0;
    const std::vector<Point> points = samples(curve, 4000);
    for (std::size_t k = 1; k < points.size(); ++k) {
      area += (points[k - 1].x() * points[k].y() - points[k - 1].y() * points[k].x()) / 2;
      length += (points[k] - points[k - 1]).norm();
    }
    EXPECT_NEAR(swept_area(curve), area, 1e-4) << i;
    EXPECT_NEAR(length_of(curve), length, 1e-4) << i;
    EXPECT_LE((point_at(curve, 0.25) - points[1000]).norm(), 1e-9) << i;
    EXPECT_NEAR(fraction_of(curve, points[1000]), 0.25, 1e-9) << i;
    const PlaneCurve piece = piece_of(curve, 0.25, 0.75);
    EXPECT_LE((point_at(piece, 0.5) - points[2000]).norm(), 1e-9) << i;
  }
}

// Round a rectangle, in along the first edge's extension and out along the last one's.
const char* const kRectangle =
    "F100 G0 X-30 Y-30\nG1 Z-3\nG41.1 D10 G1 X0 Y-20\nY50\nX80\nY0\nX-20\nG40 G1 X-30 Y-30\nG0 Z10\n";

TEST(Gouge, WaysInAndOutAreNoWalls) {
  EXPECT_EQ(Session().error(kRectangle), "");
  // twice round
  EXPECT_EQ(Session().error("F100 G0 X-30 Y-30\nG41.1 D10 G1 X0 Y-20\nY50\nX80\nY0\nX0\nY50\nX80\nY0\nX-20\n"
                            "G40 G1 X-30 Y-30\n"),
            "");
  // at two depths, back to the start under compensation
  EXPECT_EQ(
      Session().error("F100 G0 X-30 Y-30\nG41.1 D10 G1 X0 Y-20\nY50\nX80\nY0\nX-20\nY-20\nX0 Z-3\nY50\nX80\n"
                      "Y0\nX-20\nG40 G1 X-30 Y-30\n"),
      "");
  // the end stops short of the first edge
  EXPECT_EQ(Session().error("F100 G0 X-30 Y-30\nG41.1 D10 G1 X0 Y-20\nY50\nX80\nY0\nX1\nG40 G1 X-30 Y-30\n"),
            "");
  // a slot, in by an arc from its middle: the arc's own place is cut on the way back
  EXPECT_EQ(
      Session().error("F100 G0 X0 Y10\nG41.1 D5 G1 X5 Y8\nG3 X10 Y3 I5\nG1 X50\nG3 Y11 J4\nG1 X0\nG40 Y10\n"),
      "");
}

// The example of the family's handbook, with an entry arc, in inches.
TEST(Gouge, TheHandbooksExampleFits) {
  EXPECT_EQ(
      Session().error("G20 F60\nG0 X1 Y5\nG41.1 D1 G1 Y4\nG3 X2 Y3 I1\nG2 X3 Y2 J-1\nG1 Y-1\nG2 X2 Y-2 I-1\n"
                      "G1 X-2\nG2 X-2.6 Y-0.2 J1\nG1 X1.4 Y2.8\nG2 X2 Y3 I.6 J-.8\nG40\n"),
      "");
}

TEST(Gouge, ARibAsThinAsItGetsIsNoGouge) {
  EXPECT_EQ(Session().error("G20 G90 F10\nG0 X2.6 Y2.6\nG41.1 D.15\nG1 X2.3911 Y2.1499\nG1 X2.1404 Y1.3952\n"
                            "G3 X1.7494 Y1.6236 I-0.2261 J0.0618\nG3 X2.5014 Y1.3456 I0.3111 J-0.3144\n"
                            "G1 X2.7720 Y1.4846\nG40 G1 X3 Y3\n"),
            "");
}

TEST(Gouge, TheWayInAndOutMayNotCutThePart) {
  // out along the last edge of a pocket, through the wall
  const std::string out =
      Session().error("F100 G0 X20 Y20\nG41.1 D10 G1 X0 Y0\nX40\nY40\nX0\nY-20\nG40 G1 X-30 Y-30\n");
  EXPECT_NE(out.find("would gouge"), std::string::npos) << out;
  // an arc that leads off the edge of an L into its other arm
  const auto angle = [](double x) {
    return Session().error(fmt::format(
        "F100 G0 X{1} Y50\nG42.1 D6 G1 X{1} Y36\nG2 X{0} Y24 I-12\nG1 X20\nY60\nX0\nY0\nX60\nY24\n"
        "X{0}\nG2 X{2} Y36 J12\nG40 G1 Y50\n",
        x, x + 12, x - 12));
  };
  EXPECT_EQ(angle(45), "");
  EXPECT_NE(angle(28).find("p.ngc:11:1: the tool of radius 3.0000 would gouge"), std::string::npos)
      << angle(28);
}

TEST(Gouge, MovesTooShortForAnInsideCornerAreFound) {
  const auto step = [](double high) {
    return Session().error(fmt::format(
        "F100 G0 X-20 Y20\nG41.1 D10 G1 X0 Y0\nX20\nX22 Y{0}\nX40\nY{0}\nX60 Y30\nG40 Y60\n", high));
  };
  EXPECT_EQ(step(0.5), "");
  const std::string slot =
      Session().error("F100 G0 X-20 Y20\nG41.1 D10 G1 X0 Y0\nX20\nX29\nY30\nX40\nG40 Y60\n");
  EXPECT_EQ(slot, "");
  const std::string narrow =
      Session().error("F100 G0 X-20 Y20\nG41.1 D10 G1 X0 Y20\nX20\nY0\nX29\nY20\nX40\nG40 Y60\n");
  EXPECT_NE(narrow.find("p.ngc:6:"), std::string::npos) << narrow;
}

// The way down at X-4 passes the beginning of the first wall.
TEST(Gouge, AToolAboveTheWallCutsNothing) {
  const auto passes = [](double z) {
    return Session().error(
        fmt::format("F100 G0 X-20 Y-10 Z-5\nG41 D1 G1 X0 Y0\nX50\nY30\nX-4 Z{0}\nY-30\nG40 X-40\n", z));
  };
  EXPECT_EQ(passes(-2), "");
  EXPECT_NE(passes(-5), "");
  EXPECT_NE(passes(-8), "");
}

// Told once, at the move, and nothing false behind it.
TEST(Gouge, NothingFalseFollows) {
  Session session;
  CanonText sink;
  Interpreter interpreter({session.config, session.parameters, session.tools, nullptr, sink, {}});
  interpreter.open_text(
      "F100 G0 X-20 Y-10\no1 repeat [3]\nG41 D1 G1 X0 Y0\nX50\nY30\nX20\nN7 G1 Y5\nX-30\nG40 X-40\nG2 X-20 "
      "Y-10 R20\n"
      "o1 endrepeat\nG1 X0\nG41.1 D20\nG1 X1\nG2 X11 I5\nG40 G1 X0\nG2 X10 I5\nG1\nG2 X20 I5\nM30\n",
      "p.ngc");
  std::vector<std::string> errors;
  for (bool more = true; more;) {
    try {
      more = interpreter.step();
    } catch (const GcodeError& error) {
      errors.emplace_back(error.what());
      more = interpreter.recover();
    }
  }
  ASSERT_EQ(errors.size(), 2U) << fmt::format("{}", fmt::join(errors, "\n"));
  EXPECT_NE(errors[0].find("p.ngc:7:4: the tool"), std::string::npos) << errors[0];
  EXPECT_NE(errors[0].find("of line 4"), std::string::npos) << errors[0];
  EXPECT_NE(errors[1].find("p.ngc:14:1: cutter compensation"), std::string::npos) << errors[1];
}

TEST(Gouge, MayBeAWarningOrPassed) {
  const std::string program = "F100 G0 X-20 Y-10\nG41 D1 G1 X0 Y0\nX50\nY30\nX20\nY5\nX-30\nG40 X-40\n";
  Session warns;
  warns.config.gouge_check = GougeCheckMode::kWarning;
  EXPECT_EQ(warns.error(program), "");
  ASSERT_EQ(warns.warnings.size(), 1U);
  EXPECT_NE(warns.warnings[0].find("p.ngc:6:1: warning: the tool of radius 3.0000 would gouge"),
            std::string::npos)
      << warns.warnings[0];
  Session off;
  off.config.gouge_check = GougeCheckMode::kOff;
  EXPECT_EQ(off.error(program), "");
  EXPECT_TRUE(off.warnings.empty());
}

TEST(Gouge, AnEntryMoveThroughThePartIsAWarning) {
  Session session;
  EXPECT_EQ(session.error("F100 G0 X30 Y-30\nG41.1 D10 G1 X0 Y0\nY50\nX80\nY0\nX0\nG40 G1 X-30 Y-30\n"), "");
  ASSERT_EQ(session.warnings.size(), 1U);
  EXPECT_NE(session.warnings[0].find("p.ngc:2:"), std::string::npos) << session.warnings[0];
  Session clear;
  EXPECT_EQ(clear.error(kRectangle), "");
  EXPECT_TRUE(clear.warnings.empty());
}

// A hundred thousand moves, twice round, are judged without looking at every pair of them.
TEST(Gouge, LongContoursAreJudgedWhole) {
  const auto round = [](double dent) {
    std::string text = "F100 G0 X130 Y0\nG42.1 D10 G1 X100 Y0\n";
    const int moves = 50'000;
    for (int lap = 0; lap < 2; ++lap)
      for (int i = 1; i <= moves; ++i) {
        const double angle = 2 * kPi * i / moves;
        const double radius = 100 - (i == moves / 3 ? dent : 0);
        text += fmt::format("X{:.5f} Y{:.5f}\n", radius * std::cos(angle), radius * std::sin(angle));
      }
    return Session().error(text + "G40 G1 X130 Y10\n");
  };
  EXPECT_EQ(round(0), "");
  EXPECT_NE(round(0.1).find("would gouge"), std::string::npos);
}

}  // namespace
}  // namespace trn

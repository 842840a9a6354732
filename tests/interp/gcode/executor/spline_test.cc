#include <cmath>

#include "core/frames.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/error.h"
#include "tests/interp/gcode/run_program.h"

// Splines: what they are, and what is refused.
namespace trn {
namespace {

using test::Session;

/// Keeps the last spline.
struct LastSpline : CanonSink {
  void put(const CanonCommand& command, std::uint32_t) override {
    if (const auto* c = std::get_if<canon::NurbsFeed>(&command)) {
      hull = *c->bezier;
      points = c->control_points;
      to = c->to.xyz;
    }
  }
  std::vector<Vec3> hull;
  int points = 0;
  Vec3 to = Vec3::Zero();
};

LastSpline spline_of(const std::string& program) {
  LastSpline sink;
  Session().run(program + "\nM2\n", sink);
  return sink;
}

Vec3 bezier(const std::vector<Vec3>& hull, std::size_t piece, double t) {
  const Vec3* c = &hull[4 * piece];
  const double s = 1 - t;
  return s * s * s * c[0] + 3 * s * s * t * c[1] + 3 * s * t * t * c[2] + t * t * t * c[3];
}

TEST(Splines, TheCubicHasItsFourPoints) {
  const LastSpline one = spline_of("F9 G0 X1 Y2\nG5 I1 J2 P-3 Q1 X10 Y5");
  ASSERT_EQ(one.hull.size(), 4U);
  EXPECT_EQ(one.hull[1], Vec3(2, 4, 0));
  EXPECT_EQ(one.hull[2], Vec3(7, 6, 0));
  EXPECT_EQ(one.to, Vec3(10, 5, 0));
  const LastSpline next = spline_of("F9 G0 X1 Y2\nG5 I1 J2 P-3 Q1 X10 Y5\nG5 P1 Q1 X20");
  EXPECT_EQ(next.hull[1], Vec3(13, 4, 0)) << "without I and J it goes on straight";
}

// Any point of the quadratic: (1-t)^2 A + 2 t (1-t) B + t^2 D.
TEST(Splines, TheQuadraticIsItsParabola) {
  const LastSpline one = spline_of("F9 G91 G5.1 I2 J3 X10 Y0");
  for (const double t : {0.0, 0.25, 0.5, 0.9, 1.0}) {
    const Vec3 wanted = 2 * t * (1 - t) * Vec3(2, 3, 0) + t * t * Vec3(10, 0, 0);
    EXPECT_NEAR((bezier(one.hull, 0, t) - wanted).norm(), 0, 1e-12);
  }
}

// Three control points of order 3 with these weights are a quarter of a circle.
TEST(Splines, ARationalOneIsItsCircle) {
  const LastSpline arc = spline_of("F9 G0 X10\nG5.2 P1 L3 \nX10 Y10 P[SQRT[0.5]]\nX0 Y10 P1\nG5.3");
  EXPECT_EQ(arc.points, 3);
  ASSERT_EQ(arc.hull.size() % 4, 0U);
  for (std::size_t piece = 0; piece < arc.hull.size() / 4; ++piece)
    for (const double t : {0.0, 0.3, 0.7, 1.0}) EXPECT_NEAR(bezier(arc.hull, piece, t).norm(), 10, 1e-3);
}

TEST(Splines, ANurbsHasOrderThreeAndWeightOneUnlessToldOtherwise) {
  const std::string rest = "\nX10 Y10 P2\nX0 Y10 P1\nX-5 Y3 P1\nG5.3";
  const LastSpline told = spline_of("F9 G0 X10\nG5.2 P1 L3" + rest),
                   untold = spline_of("F9 G0 X10\nG5.2" + rest);
  ASSERT_EQ(told.hull.size(), untold.hull.size());
  for (std::size_t i = 0; i < told.hull.size(); ++i) EXPECT_EQ(told.hull[i], untold.hull[i]) << i;
}

TEST(Splines, ANurbsOfOrderTwoIsItsPolygon) {
  const LastSpline line = spline_of("F9 G5.2 P1 L2\nX10 Y0 P1\nX10 Y4 P1\nG5.3");
  ASSERT_GE(line.hull.size(), 8U);
  for (std::size_t piece = 0; piece < line.hull.size() / 4; ++piece)
    for (const double t : {0.0, 0.25, 0.6, 1.0}) {
      const auto p = bezier(line.hull, piece, t);
      EXPECT_LT(std::min(std::abs(p.y()), std::abs(p.x() - 10)), 1e-9) << p.x() << " " << p.y();
    }
}

TEST(Splines, AreRefusedWithTheirReason) {
  using enum GcodeErrorCode;
  struct Refusal {
    const char* program;
    GcodeErrorCode code;
    std::uint32_t line, column;
  };
  const char* start = "G6.2 P3 K0 X0 Y0\nK0 X1 Y1\nK0 X2 Y0\n";
  const std::string behind = std::string("F9 ") + start + "K1 X3\n", rotary = "F9 G6.2 P3 K0 X0 A1",
                    away = "F9 G6.2 P3 K0 X5", tail = std::string("F9 ") + start + "K1\nK1 X3";
  for (const Refusal& refusal : std::initializer_list<Refusal>{
           {"F9 G18 G5 X1 P1 Q1", kPlane, 1, 8},
           {"F9 G19 G5.1 X1 I1 J1", kPlane, 1, 8},
           {"G5 X1 I1 J1 P1 Q1", kZeroFeed, 1, 1},
           {"F9 G41.1 D2\nG5 X1 I1 J1 P1 Q1", kCompState, 2, 1},
           {"F9 G5 X1 Z1 I1 J1 P1 Q1", kSpline, 1, 10},
           {"F9 G5 X1 A1 I1 J1 P1 Q1", kSpline, 1, 10},
           {"F9 G5 X1 I1 J1 P1", kMissingWord, 1, 4},
           {"F9 G5 X1 I1 J1 Q1", kMissingWord, 1, 4},
           {"F9 G5 X1 I1 P1 Q1", kMissingWord, 1, 4},
           {"F9 G5.1 X1 I1", kMissingWord, 1, 4},
           {"F9 G5.1 X1 J1", kMissingWord, 1, 4},
           {"G5.3", kSpline, 1, 1},
           {"F9 G5.2 P1 L3\nX1 P1", kMissingWord, 2, 1},
           {"F9 G5.2 P1 L3\nX1 Y1", kMissingWord, 2, 1},
           {"F9 G5.2 P1 L3\nX1 Y1 P0", kBadValue, 2, 7},
           {"F9 G5.2 P1 L3\nX1 Y1 P1\nG5.3", kSpline, 3, 1},
           {"F9 G5.2 P1 L2.5\nX1 Y1 P1\nX2 Y1 P1\nG5.3", kSpline, 4, 1},
           {"F9 G5.2 P1 L1\nX1 Y1 P1\nX2 Y1 P1\nG5.3", kSpline, 4, 1},
           {"F9 G6.2 P3 X0", kMissingWord, 1, 4},
           {"G6.2 P3 K0 X0", kZeroFeed, 1, 1},
           {"F9 G41.1 D2\nG6.2 P3 K0 X0", kCompState, 2, 1},
           {"F9 G6.2 P1 K0 X0", kBadValue, 1, 9},
           {"F9 G6.2 P9 K0 X0", kBadValue, 1, 9},
           {"F9 G6.2 P2.5 K0 X0", kBadValue, 1, 9},
           {"F9 G6.2 P3 K1 X0\nK0 X1", kBadValue, 2, 1},
           {"F9 G6.2 P3 K0 X0 R0", kBadValue, 1, 18},
           {rotary.c_str(), kSpline, 1, 18},
           {away.c_str(), kSpline, 1, 4},
           {tail.c_str(), kSpline, 5, 1},
       }) {
    LastSpline sink;
    try {
      Session().run(std::string(refusal.program) + "\nM2\n", sink);
      ADD_FAILURE() << refusal.program << " is accepted";
    } catch (const GcodeError& error) {
      EXPECT_EQ(error.code, refusal.code) << error.what();
      EXPECT_EQ(error.line, refusal.line) << error.what();
      EXPECT_EQ(error.column, refusal.column) << refusal.program << " " << error.what();
    }
  }
  Session session;
  EXPECT_EQ(session.canon("G18 G05.1 Q1\nG5.1 Q0\nG0 X1"), session.canon("G18\nG0 X1"));
  EXPECT_EQ(session.warnings.size(), 1U) << "another control's smoothing, told once";
}

}  // namespace
}  // namespace trn

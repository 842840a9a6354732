#include <fmt/format.h>

#include <cmath>
#include <sstream>
#include <vector>

#include "core/frames.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/error.h"
#include "tests/interp/gcode/run_program.h"

// Canned cycles in the three planes, and threads.
namespace trn {
namespace {

using test::canon;
using test::Session;

/// Keeps straight moves and the pitches between them.
struct Straights : CanonSink {
  struct Step {
    bool feed = false;
    Vec3 to;
    double pitch = 0;  ///< of the gear that is closed
  };
  void put(const CanonCommand& command, std::uint32_t) override {
    if (const auto* c = std::get_if<canon::StartFeedSync>(&command)) pitch = c->per_rev;
    if (const auto* c = std::get_if<canon::Plain>(&command))
      if (c->what == PlainCanon::kStopFeedSync) pitch = 0;
    if (const auto* c = std::get_if<canon::StraightFeed>(&command)) steps.push_back({true, c->to.xyz, pitch});
    if (const auto* c = std::get_if<canon::StraightTraverse>(&command))
      steps.push_back({false, c->to.xyz, pitch});
    if (const auto* c = std::get_if<canon::ManualRetract>(&command)) steps.push_back({false, c->to.xyz, 0});
  }
  std::vector<Step> steps;
  double pitch = 0;
};

std::vector<Straights::Step> straights(const std::string& program) {
  Straights sink;
  Session().run(program + "\nM2\n", sink);
  return sink.steps;
}

/// The canonical functions with the three lengths of every move in another order.
std::string permuted(const std::string& text, const std::array<std::size_t, 3>& order) {
  std::istringstream in(text);
  std::string out;
  for (std::string line; std::getline(in, line);) {
    std::array<double, 3> v{};
    const std::size_t at = line.find('(');
    const bool move = line.rfind("STRAIGHT_", 0) == 0 &&
                      std::sscanf(line.c_str() + at, "(%lf, %lf, %lf", &v[0], &v[1], &v[2]) == 3;
    if (line.rfind("SELECT_PLANE", 0) == 0) continue;
    out += move ? fmt::format("{}({:.4f}, {:.4f}, {:.4f}\n", line.substr(0, at), v[order[0]] + 0.0,
                              v[order[1]] + 0.0, v[order[2]] + 0.0)
                : line + "\n";
  }
  return out;
}

// A cycle of G18 is that of G17 with X Z for X Y and Y for the depth, one of G19 with Y Z and X.
TEST(Cycles, AreTheSameInEveryPlane) {
  const char* const cycles[] = {"S9 M3 G81",
                                "S9 M3 G82 P.5",
                                "S9 M3 G83 Q1.3",
                                "S9 M3 G73 Q1.3",
                                "S9 M3 G84",
                                "S9 M4 G74",
                                "S9 M3 G85",
                                "S9 M3 G86 P.5",
                                "S9 M4 G88 P.5",
                                "S9 M3 G89 P.5",
                                "S9 M3 G87 I.5 J-.5 K-1"};
  for (const char* cycle : cycles)
    for (const char* rest : {"", " L2", " L3"})
      for (const char* modes : {"G90 G98", "G90 G99", "G91 G98", "G91 G99"}) {
        const auto program = [&](const char* plane, const char* first, const char* second,
                                 const char* depth) {
          return fmt::format("{0} F9 G0 {3}8\n{1} {2} {4}1 {5}2 {3}-3 R4{6}\n{4}7\nG80\n", plane, modes,
                             cycle, depth, first, second, rest);
        };
        const std::string xy = permuted(canon(program("G17", "X", "Y", "Z")), {0, 1, 2});
        ASSERT_NE(xy.find("STRAIGHT_FEED"), std::string::npos);
        EXPECT_EQ(xy, permuted(canon(program("G18", "X", "Z", "Y")), {0, 2, 1})) << cycle << modes << rest;
        EXPECT_EQ(xy, permuted(canon(program("G19", "Y", "Z", "X")), {1, 2, 0})) << cycle << modes << rest;
      }
}

// RS274/NGC, 3.5.16.8: every step of a back boring.
TEST(Cycles, BackBoringGoesInBesideTheHoleAndCutsUpwards) {
  const std::vector<Straights::Step> steps =
      straights("F9 S9 M3 G0 Z8\nG90 G98 G87 X1 Y2 Z-3 R4 I.5 J-.5 K-1");
  const std::pair<bool, Vec3> expected[] = {
      {false, {1.5, 1.5, 4}}, {false, {1.5, 1.5, -3}}, {false, {1, 2, -3}},    {true, {1, 2, -1}},
      {true, {1, 2, -3}},     {false, {1.5, 1.5, -3}}, {false, {1.5, 1.5, 8}}, {false, {1, 2, 8}}};
  ASSERT_GE(steps.size(), std::size(expected));
  const std::size_t first = steps.size() - std::size(expected);
  for (std::size_t i = 0; i < std::size(expected); ++i) {
    EXPECT_EQ(steps[first + i].feed, expected[i].first) << i;
    EXPECT_LT((steps[first + i].to - expected[i].second).norm(), 1e-12) << i;
  }
}

// G183 upright, in two strokes: down the hole, out to the clear plane, back to just above what is drilled.
// The tip's control that it needs is off again behind it.
TEST(Cycles, TiltedDrillingIsStrokesAlongTheTool) {
  Session session = test::cradle();
  const test::MoveList list = session.moves("F100 G183 X20 Y15 Z30 A0 C0 H-10 Q2 R3\nG0 Z90\nM2\n");
  const double depths[] = {33, 25, 33, 25.254, 20, 33};
  const double table = 75;  // where the work's zero lies in the cradle's table
  ASSERT_EQ(list.moves.size(), std::size(depths) + 1);
  for (std::size_t i = 0; i < std::size(depths); ++i)
    EXPECT_NEAR(list.moves[i].to[kZ], table + depths[i], 1e-9) << i;
  EXPECT_FALSE(list.moves.back().context.rtcp);
}

struct Refusal {
  const char* program;
  GcodeErrorCode code;
  std::uint32_t column;
};

void expect_refused(const Refusal& refusal) {
  struct Nothing : CanonSink {
    void put(const CanonCommand&, std::uint32_t) override {}
  } nothing;
  try {
    Session().run(std::string(refusal.program) + "\nM2\n", nothing);
    ADD_FAILURE() << refusal.program << " is accepted";
  } catch (const GcodeError& error) {
    EXPECT_EQ(error.code, refusal.code) << refusal.program << ": " << error.what();
    EXPECT_EQ(error.column, refusal.column) << refusal.program << ": " << error.what();
  }
}

TEST(Cycles, WordsThatDoNotFitAreRefused) {
  using enum GcodeErrorCode;
  for (const Refusal& refusal : std::initializer_list<Refusal>{
           {"F9 G81 Z-1", kMissingWord, 4},
           {"F9 G81 R1", kMissingWord, 4},
           {"F9 G18 G81 Y-1", kMissingWord, 8},
           {"F9 G19 G81 R1 Y1", kMissingWord, 8},
           {"F9 G82 Z-1 R1", kMissingWord, 4},
           {"F9 G83 Z-1 R1", kMissingWord, 4},
           {"F9 G83 Z-1 R1 Q0", kBadValue, 15},
           {"F9 G73 Z-1 R1 Q-2", kBadValue, 15},
           {"F9 G83 Z-1 R1 Q.0001", kBadValue, 15},
           {"F9 G73 Z-22222222222206 R1 Q2.9", kBadValue, 28},
           {"F9 G73 Z-1 R1 Q1\nZ-10000 R1", kBadValue, 1},
           {"F9 G82 Z-1 R1 P-1", kBadValue, 15},
           {"F9 G81 Z-1 R1 L0", kBadValue, 15},
           {"F9 G81 Z-1 R1 L1000001", kBadValue, 15},
           {"F9 S1 M3 G87 Z-1 R1 I1 J1", kMissingWord, 10},
           {"F9 S1 M3 G87 Z-1 R1 I1 K1", kMissingWord, 10},
           {"F9 S1 M3 G87 Z-1 R1 J1 K1", kMissingWord, 10},
           {"F9 G86 Z-1 R1 P1", kNoSpindle, 4},
           {"F9 G87 Z-1 R1 I1 J1 K1", kNoSpindle, 4},
           {"F9 G88 Z-1 R1 P1", kNoSpindle, 4},
           {"F9 S1 M4 G84 Z-1 R1", kSpindleDirection, 10},
           {"F9 S1 M3 G74 Z-1 R1", kSpindleDirection, 10},
           {"G81 Z-1 R1", kZeroFeed, 1},
           {"F9 G18 G81 Y1 R0", kCycle, 8},
           {"F9 G41.1 D2\nG81 Z-1 R1", kCompState, 1},
           {"F9 G183 X1 H0", kBadValue, 12},
           {"F9 G183 X1 H0.5", kBadValue, 12},
       })
    expect_refused(refusal);
}

// Once in a program; half a second is what it seems to be.
TEST(Cycles, ALongDwellIsToldAsInG4) {
  for (const char* code : {"G82", "G86", "G88", "G89"}) {
    test::Session session;
    session.canon(std::string("S9 M3 F9\n") + code + " X1 Z-1 R1 P2000\nX2 P3000");
    ASSERT_EQ(session.warnings.size(), 1u) << code;
    const std::string told = std::string(code) +
                             " P2000 waits 2000 seconds; controls that count in milliseconds mean " + code +
                             " P2";
    EXPECT_NE(session.warnings[0].find(told), std::string::npos) << session.warnings[0];
  }
  test::Session session;
  session.canon("F9 G82 X1 Z-1 R1 P0.5");
  EXPECT_TRUE(session.warnings.empty());
}

TEST(Threads, AGearedMoveIsAFeedBetweenItsMarks) {
  EXPECT_EQ(
      canon("S9 M3 G33 Z-5 K1.5\nG33 X1 Z-9 K2"),
      test::moves({"SET_SPINDLE_MODE(0 0.0000)", "SET_SPINDLE_SPEED(0, 9.0000)", "START_SPINDLE_CLOCKWISE(0)",
                   "START_SPEED_FEED_SYNC(1.500000,0)", "F 0 0 -5", "STOP_SPEED_FEED_SYNCH()",
                   "START_SPEED_FEED_SYNC(2.000000,0)", "F 1 0 -9", "STOP_SPEED_FEED_SYNCH()"})
          .substr(std::string("SET_SPINDLE_MODE(0 0.0000)\n").size()));
  const std::string tap = canon("S9 M4 G33.1 Z-5 K1.5\nG0 X1");
  EXPECT_NE(tap.find("RIGID_TAP(0.0000, 0.0000, -5.0000"), std::string::npos) << tap;
  EXPECT_NE(tap.find("STRAIGHT_TRAVERSE(1.0000, 0.0000, 0.0000"), std::string::npos)
      << "the tap ends where it began: " << tap;
}

TEST(Threads, AreRefusedWithTheirReason) {
  using enum GcodeErrorCode;
  for (const Refusal& refusal : std::initializer_list<Refusal>{
           {"G33 Z-1 K1", kNoSpindle, 1},
           {"G33.1 Z-1 K1", kNoSpindle, 1},
           {"S9 M3\nG33 Z-1", kMissingWord, 1},
           {"S9 M3\nG33.1 Z-1", kMissingWord, 1},
           {"S9 M3 F9 G41.1 D2\nG33 Z-1 K1", kCompState, 1},
           {"S9 M3 F9 G41.1 D2\nG33.1 Z-1 K1", kCompState, 1},
           {"G76 P1 Z-5 I-1 J.2 K.6", kNoSpindle, 1},
           {"S9 M3 F9 G41.1 D2\nG76 P1 Z-5 I-1 J.2 K.6", kCompState, 1},
           {"S9 M3\nG76 P1 Z-5 I0 J.2 K.6", kBadValue, 12},
           {"S9 M3\nG76 P-1 Z-5 I-1 J.2 K.6", kBadValue, 5},
           {"S9 M3\nG76 P1 Z-5 I-1 J0 K.6", kBadValue, 16},
           {"S9 M3\nG76 P1 Z-5 I-1 J.6 K.6", kBadValue, 20},
           {"S9 M3\nG76 P1 Z-5 I-1 J.2 K.6 L1.5", kBadValue, 24},
           {"S9 M3\nG76 P1 Z-5 I-1 J.2 K.6 L-1", kBadValue, 24},
           {"S9 M3\nG76 P1 Z-5 I-1 J.2 K.6 H1.5", kBadValue, 24},
           {"S9 M3\nG76 P1 Z-5 I-1 J.2 K.6 H10000", kBadValue, 24},
           {"S9 M3\nG76 P1 Z-5 I-1 J.2 K.6 Q90", kBadValue, 24},
           {"S9 M3\nG76 P1 Z-5 I-1 J.0001 K9 R1", kBadValue, 16},
           {"S9 M3\nG76 P1 Z-5 I-1 J.2 K.6 A3", kCycle, 24},
           {"S9 M3\nG76 P1 Z-5 J.2 K.6", kMissingWord, 1},
           {"S9 M3\nG76 P1 Z-5 I-1 K.6", kMissingWord, 1},
           {"S9 M3\nG76 P1 Z-5 I-1 J.2", kMissingWord, 1},
           {"S9 M3\nG76 Z-5 I-1 J.2 K.6", kMissingWord, 1},
       })
    expect_refused(refusal);
}

// What the reference manual says of G76: pass n is J times the R-th root of n deep beyond the peak, the last
// one and H more are K deep; between drive line and thread the tool goes in and out at both ends.
TEST(Threads, PassesAreAsDeepAsTheManualSays) {
  const double peak = -1, first = 0.2, full = 0.6, roots = 1.5;
  const auto steps = straights("G18 S9 M3 G0 X10 Z2\nG76 P1.25 Z-20 I-1 J0.2 K0.6 R1.5 H2");
  std::vector<double> depths;
  for (const auto& step : steps) {
    if (!step.feed) continue;
    EXPECT_EQ(step.pitch, 1.25);
    EXPECT_NEAR(step.to.z(), -20, 1e-12) << "no compound angle, no taper";
    depths.push_back(10 + peak - step.to.x());
  }
  std::vector<double> wanted;
  for (int n = 1; first * std::pow(n, 1 / roots) < full; ++n)
    wanted.push_back(first * std::pow(n, 1 / roots));
  for (int spring = 0; spring < 3; ++spring) wanted.push_back(full);
  ASSERT_EQ(depths.size(), wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) EXPECT_NEAR(depths[i], wanted[i], 1e-9) << i;
  EXPECT_NEAR(steps.back().to.x(), 10, 1e-12);
  EXPECT_NEAR(steps.back().to.z(), -20, 1e-12);
}

// With the compound angle Q a pass begins as much farther along the thread as it is deeper, times tan Q; in
// the tapers E the tool goes the full way from crest to root.
TEST(Threads, SlidesAndTapers) {
  const double slope = std::tan(29.5 * M_PI / 180);
  double start = 0;
  for (const auto& step : straights("G18 S9 M3 G0 X10 Z0\nG76 P1 Z-20 I1 J0.3 K0.6 Q29.5")) {
    if (!step.feed) {
      start = step.to.z();
      continue;
    }
    const double depth = step.to.x() - 11;
    EXPECT_NEAR(start, -depth * slope, 1e-9);
    EXPECT_NEAR(step.to.z(), -20 + (0.6 - depth) * slope, 1e-9);
  }
  const auto tapered = straights("G18 S9 M3 G0 X10 Z0\nG76 P1 Z-20 I-1 J0.5 K0.6 R1 L3 E1.5");
  std::vector<Straights::Step> feeds;
  for (const auto& step : tapered)
    if (step.feed) feeds.push_back(step);
  ASSERT_EQ(feeds.size(), 8U) << "two passes of entry, taper in, thread, taper out";
  const double taper_pitch = std::hypot(1.5, 0.6) / 1.5;
  for (std::size_t i = 0; i < feeds.size(); ++i)
    EXPECT_NEAR(feeds[i].pitch, i % 4 == 2 ? 1 : taper_pitch, 1e-12) << i;
  EXPECT_NEAR(feeds[5].to.x(), 10 - 1 - 0.6, 1e-12);
  EXPECT_NEAR(feeds[5].to.z(), -1.5, 1e-12);
  EXPECT_NEAR(feeds[6].to.z(), -20 + 1.5, 1e-12);
  EXPECT_NEAR(feeds[7].to.x(), 10 - 1, 1e-12);
}

TEST(Threads, LengthsAreHalvedOnceInDiameterMode) {
  const auto radius = straights("G18 S9 M3 G0 X10 Z0\nG76 P1 Z-20 I-1 J0.2 K0.6");
  const auto diameter = straights("G18 S9 M3 G7 G0 X20 Z0\nG76 P1 Z-20 I-2 J0.4 K1.2");
  ASSERT_EQ(radius.size(), diameter.size());
  for (std::size_t i = 0; i < radius.size(); ++i)
    EXPECT_NEAR((radius[i].to - diameter[i].to).norm(), 0, 1e-12) << i;
}

}  // namespace
}  // namespace trn

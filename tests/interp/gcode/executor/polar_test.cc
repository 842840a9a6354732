#include <fmt/format.h>

#include <cmath>
#include <random>

#include "core/frames.h"
#include "interp/gcode/canon.h"
#include "tests/interp/gcode/run_program.h"
#include "tests/support/rounds.h"

// Cycles whose holes are given by @ and ^, beside the same holes written out as G0 and G1.
namespace trn {
namespace {

using test::Session;

struct Move {
  bool feed;
  Vec3 to;
};

/// Moves that lead somewhere; a dwell or a spindle word between them counts as none.
struct Moves : CanonSink {
  void put(const CanonCommand& command, std::uint32_t) override {
    if (const auto* c = std::get_if<canon::StraightFeed>(&command)) add(true, c->to.xyz);
    if (const auto* c = std::get_if<canon::StraightTraverse>(&command)) add(false, c->to.xyz);
  }
  void add(bool feed, const Vec3& to) {
    if ((to - at).norm() > 1e-9) moves.push_back({feed, to});
    at = to;
  }
  std::vector<Move> moves;
  Vec3 at = Vec3::Zero();
};

std::vector<Move> moves_of(const std::string& program) {
  Moves sink;
  Session session;
  session.run(program + "M2\n", sink);
  return sink.moves;
}

/// Program text of one hole, written out.
class ByHand {
 public:
  std::string text;
  void rapid(double x, double y, double z) { line("G0", x, y, z); }
  void feed(double x, double y, double z) { line("G1", x, y, z); }

 private:
  void line(const char* code, double x, double y, double z) {
    text += fmt::format("{} X{:.12f} Y{:.12f} Z{:.12f}\n", code, x, y, z);
  }
};

struct Hole {
  double x, y, r, bottom, clear, peck;
};

void drill(int cycle, const Hole& h, double clearance, ByHand& out) {
  if (cycle == 73 || cycle == 83) {
    double depth = h.r - h.peck;
    for (; depth > h.bottom; depth -= h.peck) {
      out.feed(h.x, h.y, depth);
      if (cycle == 83) out.rapid(h.x, h.y, h.r);
      out.rapid(h.x, h.y, depth + clearance);
    }
  }
  out.feed(h.x, h.y, h.bottom);
  if (cycle == 85) out.feed(h.x, h.y, h.r);
  if (cycle == 89)
    out.feed(h.x, h.y, h.clear);
  else
    out.rapid(h.x, h.y, h.clear);
}

struct PolarCase {
  std::string cycle, by_hand;
};

/// A start, a cycle with polar words and repeats, and a second line of it.
PolarCase make_case(std::mt19937& rng) {
  const auto pick = [&](double low, double high) {
    return std::round(1e3 * std::uniform_real_distribution(low, high)(rng)) / 1e3;
  };
  constexpr int kCycles[] = {73, 81, 82, 83, 85, 89};
  const int cycle = kCycles[rng() % 6];
  const bool more = rng() % 2, old_z = rng() % 2, inch = rng() % 2;
  double x = pick(5, 20), y = pick(-20, 20), height = pick(5, 9);
  const double start = height, r = pick(1, 4), depth = pick(-6, -1), peck = pick(0.7, 2);
  const double r_abs = more ? start + r : r, bottom = more ? r_abs + depth : depth;
  ByHand hand;
  hand.rapid(x, y, start);
  std::string text = fmt::format("{} G90 S1 F100 G0 X{} Y{} Z{}\n{} {}\n", inch ? "G20" : "G21", x, y, start,
                                 more ? "G91" : "G90", old_z ? "G98" : "G99");
  for (int line = 0; line < 2; ++line) {
    const int words = 1 + static_cast<int>(rng() % 3), repeats = 1 + static_cast<int>(rng() % 4);
    const double radius = more ? pick(0.1, 3) : pick(2, 20), angle = pick(-170, 170);
    text += line == 0 ? fmt::format("G{} R{} Z{} Q{} P0.1", cycle, r, depth, peck) : "";
    if (line == 0 && cycle != 73 && cycle != 83)
      text.replace(text.rfind(" Q"), text.rfind(" P") - text.rfind(" Q"), "");
    if (line == 0 && cycle != 82 && cycle != 89) text.resize(text.rfind(" P"));
    if (words & 1) text += fmt::format(" @{}", radius);
    if (words & 2) text += fmt::format(" ^{}", angle);
    text += fmt::format(" L{}\n", repeats);
    const double clear = old_z ? std::max(start, r_abs) : r_abs;
    if (height < r_abs) hand.rapid(x, y, height = r_abs);
    for (int i = 0; i < repeats; ++i) {
      const double turn = rad_from_deg(angle);
      const double far = std::hypot(x, y), at = std::atan2(y, x);
      const double to_far = !(words & 1) ? far : more ? far + radius : radius;
      const double to_at = !(words & 2) ? at : more ? at + turn : turn;
      x = to_far * std::cos(to_at);
      y = to_far * std::sin(to_at);
      hand.rapid(x, y, height);
      hand.rapid(x, y, r_abs);
      drill(cycle, {x, y, r_abs, bottom, clear, peck}, inch ? 0.01 : 0.254, hand);
      height = clear;
    }
  }
  return {text, fmt::format("{} G90 F100\n", inch ? "G20" : "G21") + hand.text};
}

TEST(Polar, EveryRepeatOfACycleIsAHoleOfItsOwn) {
  std::mt19937 rng(20);
  for (int i = 0; i < 50 * test::rounds(8); ++i) {
    const PolarCase c = make_case(rng);
    const std::vector<Move> ours = moves_of(c.cycle), expected = moves_of(c.by_hand);
    ASSERT_EQ(ours.size(), expected.size()) << c.cycle << "\n" << c.by_hand;
    for (std::size_t k = 0; k < ours.size(); ++k) {
      ASSERT_EQ(ours[k].feed, expected[k].feed) << c.cycle << "move " << k;
      ASSERT_LT((ours[k].to - expected[k].to).norm(), 1e-6) << c.cycle << "move " << k;
    }
  }
}

// The published picture of the words: holes at 60, 120 and 180 degrees.
TEST(Polar, AHoleCircle) {
  const std::string text = Session().canon("F10\nG0 X1.5\nG91 G81 R.1 Z-.5 ^60 L3");
  for (const char* hole : {"STRAIGHT_FEED(0.7500, 1.2990, -0.4000", "STRAIGHT_FEED(-0.7500, 1.2990, -0.4000",
                           "STRAIGHT_FEED(-1.5000, 0.0000, -0.4000"})
    EXPECT_NE(text.find(hole), std::string::npos) << hole << "\n" << text;
}

TEST(Polar, CyclesAndArcsOfOtherPlanesHaveNoPolarWords) {
  for (const char* program : {"F9 G18 G0 X1 Z1\nG81 R1 Y-1 X1 Z2\n@2", "F9 G19 G0 X1\nG81 R1 X-1 Y1 Z2\n^2",
                              "F9 G18 G0 X1\nG2 @1 ^30 K1"})
    EXPECT_NE(Session().error(program).find("in G17 only"), std::string::npos) << program;
  EXPECT_EQ(Session().error("G18 G0 @1 ^30"), "");
}

TEST(Polar, ARepeatThatComesToTheOriginIsRefused) {
  EXPECT_NE(Session().error("F9 G0 X1\nG91 G81 @-1 R1 Z-1 L2").find("at the origin"), std::string::npos);
}

}  // namespace
}  // namespace trn

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "core/axes.h"
#include "core/motion.h"
#include "core/ports.h"
#include "interp/move.h"
#include "interp/plan/geometry/geometry_planner.h"
#include "interp/plan/speed/speed_planner.h"
#include "tests/interp/plan/speed_support.h"
#include "tests/support/rounds.h"

// Passes over seeded freeform surfaces, the tool along the normal: how finely a pass is cut into moves, in
// which direction it goes and where its vertices happen to lie must not matter.
namespace trn::speed_test {
namespace {

constexpr double kLength = 60, kTolerance_mm = 0.01, kTolerance_rad = 0.1 * kRadPerDeg, kFeed = 150;

/// A profile z(x) of sines whose radius of curvature stays above 6 mm, and a tool that follows its normal.
struct Surface {
  double amplitude[4], wave[4], phase[4];
  bool five_axes;

  Surface(unsigned seed, bool tool_turns) : five_axes(tool_turns) {
    std::mt19937_64 rng(seed);
    std::uniform_real_distribution<double> u(0, 1);
    for (int i = 0; i < 4; ++i) {
      wave[i] = 6 * std::pow(8.0, u(rng));
      amplitude[i] = (0.02 + 0.02 * u(rng)) * std::pow(wave[i] / 6, 2) * 1.5;
      phase[i] = 2 * kPi * u(rng);
    }
  }
  Words at(double x) const {
    Words y = Words::Zero();
    double z = 0, slope = 0;
    for (int i = 0; i < 4; ++i) {
      const double w = 2 * kPi / wave[i];
      z += amplitude[i] * std::sin(w * x + phase[i]);
      slope += amplitude[i] * w * std::cos(w * x + phase[i]);
    }
    y.head<3>() << x, 0.1 * x, z;
    if (five_axes) {
      y[kA] = 0.4 + 0.3 * std::atan(slope);
      y[kC] = 0.2 + 0.4 * std::atan(slope);
    }
    return y;
  }
};

/// Vertices `chord` apart, the first inner one after `shift` of it; rounded as CAM programs are.
std::vector<Words> vertices(const Surface& surface, double chord, double shift, bool backwards) {
  std::vector<Words> out{surface.at(0)};
  for (double x = shift * chord; x < kLength; x += chord)
    if (x > 0.2 * chord && x < kLength - 0.2 * chord) out.push_back(surface.at(x));
  out.push_back(surface.at(kLength));
  for (Words& y : out) {
    for (int i = 0; i < 3; ++i) y[i] = std::round(y[i] * 1e4) / 1e4;
    for (int i = 3; i < 6; ++i) y[i] = std::round(y[i] * kDegPerRad * 1e4) / 1e4 * kRadPerDeg;
  }
  if (backwards) std::reverse(out.begin(), out.end());
  return out;
}

struct Pass {
  double time_s = 0;
  std::vector<double> speed;  ///< of the tip along X, at each millimetre
};

/// Forwards or backwards, speeds by place.
Pass drive(const std::vector<Words>& points, bool five_axes) {
  static const IdentityMap xyz({kX, kY, kZ});
  static const TrunnionMap trunnion;
  const JointMap& map = five_axes ? static_cast<const JointMap&>(trunnion) : xyz;
  const Joints joints = five_axes ? cradle_joints() : linear_joints(3);
  Collector out;
  SpeedPlanner speed(joints, map, full_shares(), out);
  GeometryPlanner geometry({}, speed);
  for (size_t i = 1; i < points.size(); ++i) {
    ProgramMove m;
    m.kind = ProgramMove::Kind::kFeed;
    m.from = points[i - 1];
    m.to = points[i];
    m.context.rtcp = true;
    m.feed.tip_mm_s = kFeed;
    m.tolerance_mm = kTolerance_mm;
    m.tolerance_rad = kTolerance_rad;
    m.source.line = static_cast<std::uint32_t>(i);
    geometry.move(m);
  }
  geometry.finish();
  speed.finish();
  Pass pass;
  pass.speed.assign(static_cast<size_t>(kLength) + 1, 0);
  for (const MotionBlock& b : out.blocks)
    for (int i = 0; i < b.segment_count; ++i) {
      const TimeSegment& g = b.segments[static_cast<size_t>(i)];
      pass.time_s += g.duration_s;
      const double x0 = b.piece.at(g.s)[kX], x1 = b.piece.at(g.s_at(g.duration_s))[kX];
      for (double x = std::ceil(std::min(x0, x1)); x <= std::max(x0, x1); ++x) {
        const double share = x1 != x0 ? (x - x0) / (x1 - x0) : 0, t = share * g.duration_s;
        pass.speed[static_cast<size_t>(x)] = std::abs(b.piece.derivatives(g.s_at(t)).d1[kX] * g.v_at(t));
      }
    }
  return pass;
}

/// Differences of the speeds at the millimetres away from the ends, over the speed there.
struct Apart {
  double worst = 0;
  int places = 0, unlike = 0;  ///< unlike: by more than 1 %
};

Apart apart(const Pass& a, const Pass& b) {
  Apart out;
  for (size_t i = 5; i + 5 < a.speed.size(); ++i) {
    const double difference = std::abs(a.speed[i] - b.speed[i]) / std::max(a.speed[i], b.speed[i]);
    out.worst = std::max(out.worst, difference);
    ++out.places;
    out.unlike += difference > 0.01 ? 1 : 0;
  }
  return out;
}

/// How much one thing differs, over the seeds.
struct Spread {
  double worst = 0, sum = 0;
  int count = 0;
  void add(double difference) {
    worst = std::max(worst, difference);
    sum += difference;
    ++count;
  }
  double mean() const { return sum / count; }
};

struct Spreads {
  Spread coarse_time, back_time, shift_time, back_speed, shift_speed;
  int places = 0, unlike = 0;
};

void drive_surface(unsigned seed, bool five, Spreads& all) {
  const Surface surface(seed, five);
  const Pass fine = drive(vertices(surface, 0.05, 1, false), five);
  const Pass coarse = drive(vertices(surface, 0.5, 1, false), five);
  const Pass back = drive(vertices(surface, 0.5, 1, true), five);
  const Pass shifted = drive(vertices(surface, 0.5, 0.5, false), five);
  const auto off = [](double a, double b) { return std::abs(a / b - 1); };
  const double k = off(back.time_s, coarse.time_s), s = off(shifted.time_s, coarse.time_s);
  const Apart back_apart = apart(back, coarse), shift_apart = apart(shifted, coarse);
  std::printf(
      "seed %u, %d axes: fine %.3f s; coarse %+.2f %%, back %.2f %%, shifted %.2f %%; speeds apart %.1f "
      "%%, %.1f %%\n",
      seed, five ? 5 : 3, fine.time_s, 100 * (coarse.time_s / fine.time_s - 1), 100 * k, 100 * s,
      100 * back_apart.worst, 100 * shift_apart.worst);
  all.coarse_time.add(off(coarse.time_s, fine.time_s));
  all.back_time.add(k);
  all.shift_time.add(s);
  all.back_speed.add(back_apart.worst);
  all.shift_speed.add(shift_apart.worst);
  all.places += back_apart.places + shift_apart.places;
  all.unlike += back_apart.unlike + shift_apart.unlike;
}

TEST(SurfacePass, CutFinelyOrCoarselyForwardsOrBackwards) {
  const auto count = static_cast<unsigned>(test::rounds(8));
  for (const bool five : {false, true}) {
    SCOPED_TRACE(five ? "five axes" : "three axes");
    Spreads all;
    for (unsigned seed = 0; seed < count; ++seed) drive_surface(seed, five, all);
    std::printf("%d axes, mean and worst difference:", five ? 5 : 3);
    const auto tell = [](const char* what, const Spread& s) {
      std::printf(" %s %.2f %% %.2f %%;", what, 100 * s.mean(), 100 * s.worst);
    };
    tell("times: coarse", all.coarse_time);
    tell("back", all.back_time);
    tell("shifted", all.shift_time);
    tell("speeds: back", all.back_speed);
    tell("shifted", all.shift_speed);
    std::printf(" %d of %d places over 1 %%\n", all.unlike, all.places);
    EXPECT_LT(all.unlike, 0.001 * all.places);
    EXPECT_LT(all.coarse_time.worst, 0.003);
    EXPECT_LT(all.back_time.worst, 0.002);
    EXPECT_LT(all.shift_time.worst, 0.002);
    EXPECT_LT(all.back_speed.mean(), 0.005);
    EXPECT_LT(all.shift_speed.mean(), 0.005);
  }
}

}  // namespace
}  // namespace trn::speed_test

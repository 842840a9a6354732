#include "core/axes.h"
#include "core/frames.h"
#include "interp/move.h"
#include "tests/interp/plan/driven_program.h"
#include "tests/support/rounds.h"

// Random programs of long, short and tiny moves: the speed stage never stops the machine where the path need
// not. TRN_LONG=10000: so many programs.
namespace trn::speed_test {
namespace {

class RandomProgram {
 public:
  explicit RandomProgram(unsigned seed) : rng_(seed) {}

  std::vector<ProgramMove> moves() {
    std::vector<ProgramMove> out;
    m_.tolerance_mm = pick({0.01, 0.01, 0.05, power(1e-4, 0.1)});
    m_.tolerance_rad = pick({0.001, 0.01});
    turning_ = rng_() % 2 == 0;
    set_feed();
    for (size_t i = 0, n = 3 + rng_() % 40; i < n; ++i) {
      if (rng_() % 15 == 0) m_.mode = rng_() % 3 == 0 ? PathMode::kExactPath : PathMode::kContinuous;
      if (rng_() % 12 == 0) set_feed();
      rng_() % 4 == 0 ? arc() : line();
      if (path_norm(m_.to - m_.from) == 0 && m_.kind != ProgramMove::Kind::kArc) continue;
      m_.source.line = static_cast<std::uint32_t>(out.size() + 1);
      out.push_back(m_);
      m_.from = m_.to;
    }
    return out;
  }

 private:
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(rng_); }
  double power(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  double pick(std::vector<double> of) { return of[rng_() % of.size()]; }

  void set_feed() {
    m_.feed.tip_mm_s = power(0.5, 500);
    m_.feed.rotary_rad_s = m_.feed.tip_mm_s * kRadPerDeg;
  }

  void line() {
    m_.kind = ProgramMove::Kind::kFeed;
    const double size = pick({power(1e-6, 1e-3), power(1e-3, 1), power(1, 100), power(1, 100), 1e-4});
    const bool rotary_only = turning_ && rng_() % 5 == 0;
    for (int k = 0; k < 3 && !rotary_only; ++k)
      if (rng_() % 2 == 0) m_.to[k] = std::clamp(m_.from[k] + size * uniform(-1, 1), -500.0, 500.0);
    if (turning_ && rng_() % 2 == 0) m_.to[kA] = m_.from[kA] + size * kRadPerDeg * uniform(-1, 1);
    if (rotary_only || (turning_ && rng_() % 2 == 0))
      m_.to[kC] = m_.from[kC] + 3 * size * kRadPerDeg * uniform(-1, 1);
    if (rng_() % 2 == 0)
      for (int k = 0; k < 3; ++k) m_.to[k] = std::round(m_.to[k] * 1e4) / 1e4;
  }

  void arc() {
    m_.kind = ProgramMove::Kind::kArc;
    const double radius = pick({power(1e-4, 1e-2), power(1e-2, 1), power(1, 30)}),
                 angle = uniform(0, 2 * kPi);
    m_.arc_axis = Vec3::UnitZ();
    m_.arc_centre = m_.from.head<3>() + radius * Vec3(std::cos(angle), std::sin(angle), 0);
    m_.arc_sweep_rad = uniform(0.05, 6.2) * (rng_() % 2 ? 1 : -1);
    const double end = angle + kPi + m_.arc_sweep_rad;
    m_.to = m_.from;
    m_.to.head<3>() = m_.arc_centre + radius * Vec3(std::cos(end), std::sin(end), 0);
    if (rng_() % 3 == 0) m_.to[kZ] += radius * uniform(-1, 1);
    for (int k = 0; k < 3; ++k) m_.to[k] = std::round(m_.to[k] * 1e6) / 1e6;
  }

  std::mt19937_64 rng_;
  bool turning_ = false;
  ProgramMove m_ = geometry_check::line_move(Words::Zero(), Words::Zero());
};

TEST(PlanStops, NoneInRandomPrograms) {
  for (int seed = 1; seed <= test::rounds(60); ++seed) {
    const DrivenProgram driven =
        drive_program(RandomProgram(static_cast<unsigned>(seed)).moves(), seed % 10 == 0);
    EXPECT_EQ(driven.stats.fallbacks, 0U) << "seed " << seed;
    EXPECT_LE(driven.verdict.jerk, 1) << "seed " << seed;
    EXPECT_LE(driven.verdict.acceleration, 1) << "seed " << seed;
  }
}

}  // namespace
}  // namespace trn::speed_test

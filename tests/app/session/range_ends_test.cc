#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "core/units.h"
#include "tests/app/session/machine_run.h"

// Programs that go to the very ends of the joints' ranges, through the whole kernel.
namespace trn::test {
namespace {

// Circles that touch an end of the mill's range run, wherever on their way the joint turns back.
TEST(RangeEnds, AnArcThatTouchesTheEndRuns) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> radius(3, 140), start(0.2, 6);
  for (int i = 0; i < 25; ++i) {
    const double r = std::round(radius(random) * 100) / 100, from = start(random);
    const double x = r * std::cos(from), y = r * std::sin(from);
    const double side = i % 2 ? 1 : -1, centre = side * (300 - r);
    SCOPED_TRACE(fmt::format("radius {} from {}", r, from));
    const MachineRun run = run_text(
        config_of("mill"), fmt::format("G21 G90 G17 F6000\nG0 X{:.9f} Y{:.9f}\nG{} I{:.9f} J{:.9f}\nM2\n",
                                       centre + x, y, i % 3 ? 2 : 3, -x, -y));
    double most = 0;
    for (const Sample& sample : run.samples) most = std::max(most, std::abs(sample.q[0]));
    EXPECT_GT(most, 299.9);
    EXPECT_LT(most, 300 + 1e-6);
  }
}

// A Z whose zero is the upper end of its range, homed at that end: the drive comes to rest a little above.
TEST(RangeEnds, AnAxisHomedAtItsEndRuns) {
  std::string text = text_of(config_of("mill"));
  const auto put = [&](const std::string& old, const std::string& now) {
    ASSERT_NE(text.find(old), std::string::npos) << old;
    text.replace(text.rfind(old), old.size(), now);
  };
  const std::size_t z = text.find("name = \"Z\"");
  text.replace(text.find("max_mm = 250.0", z), 14, "max_mm = 0.0  ");
  put("[drives]\ntype = \"simulated\"", "[drives]\ntype = \"simulated\"\nhomed = false");
  const MachineRun run =
      run_text(written("homed_at_end.toml", text), "G21 G90\nG0 X10\nG0 Z-5\nG53 G0 Z0\nM2\n");
  ASSERT_FALSE(run.samples.empty());
  EXPECT_GT(run.start.q[2], 1e-3) << "it stands outside";
  EXPECT_NEAR(run.samples.back().q[2], 0, 1e-9);
}

}  // namespace
}  // namespace trn::test

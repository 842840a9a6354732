#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "app/check/limit_judge.h"
#include "app/lab/run_report.h"
#include "app/session/assembly.h"
#include "app/session/simulation.h"
#include "core/fault.h"
#include "core/ports.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/joint_map.h"
#include "kernel/rt_messages.h"
#include "sim/simulated_drives.h"
#include "tests/app/session/machine_run.h"

// What a run shows and keeps from its first row to its last, whatever happens on the way.
namespace trn {
namespace {

using test::config_of;

class Reports : public ReportSink {
 public:
  void write(const CycleReport& report) override {
    if (at_period && ++period_ == kPeriod) at_period();
    if (report.motion == MotionState::kMoving) moving.push_back(report);
    last = report.motion;
  }
  static constexpr int kPeriod = 300;
  std::function<void()> at_period;
  std::vector<CycleReport> moving;
  MotionState last = MotionState::kRest;

 private:
  int period_ = 0;
};

SimulationResult run(Assembly& assembly, const std::string& text, Reports& reports) {
  Parameters parameters;
  ToolTable tools = ToolTable::parse("T1 P1 Z+50 D6\nT2 P2 Z+80 D8\nT3 P3 Z+95 D5\n", "t.tbl");
  SimulationOptions options;
  options.program = "promises.ngc";
  options.program_text = text;
  options.trace = &reports;
  return simulate(assembly, parameters, tools, options);
}

TEST(RunPromises, EveryRowIsInTheProgramsFrame) {
  for (const char* machine : {"cradle", "head", "head_table", "hexapod", "mill"}) {
    Assembly assembly = assemble(config_of(machine));
    Reports reports;
    run(assembly, "G21 G90 G54\nG10 L2 P1 X3 Y-4 Z5\nG4 P0.02\nS100 M3\nG4 P0.02\nG1 X5 Y1 F600\nG1 X7\nM2\n",
        reports);
    ASSERT_GT(reports.moving.size(), 50u);
    ToolPose before, now;
    ASSERT_EQ(tool_pose(*assembly.kinematics, reports.moving[0].q_plan, reports.moving[0].context, before),
              KinStatus::kOk);
    for (const CycleReport& report : reports.moving) {
      ASSERT_EQ(tool_pose(*assembly.kinematics, report.q_plan, report.context, now), KinStatus::kOk);
      ASSERT_LT((now.p_W - before.p_W).norm(), 0.5) << machine << " period " << report.period;
      before = now;
    }
    EXPECT_LT((now.p_W.head<2>() - Eigen::Vector2d(7, 1)).norm(), 1e-6) << machine;
  }
}

TEST(RunPromises, AFollowingErrorStopsWithinTheLimits) {
  for (const char* machine : {"cradle", "head_table", "mill"}) {
    Assembly assembly = assemble(config_of(machine));
    Reports reports;
    auto* drives = dynamic_cast<SimulatedDrives*>(assembly.drives.get());
    ASSERT_NE(drives, nullptr);
    reports.at_period = [&] { drives->joint(0).set_stuck(true); };
    const SimulationResult result =
        run(assembly, "G21 G90 G64 P0.01\nG1 X60 F6000\nG1 X-60 Y10\nM2\n", reports);
    EXPECT_EQ(result.fault, Fault::kFollowingError) << machine;
    EXPECT_TRUE(result.within_limits) << machine << broken_promises(result, assembly.machine);
    EXPECT_EQ(reports.last, MotionState::kRest);
  }
}

TEST(RunPromises, WhatIsBrokenIsToldWithItsLine) {
  const Assembly assembly = assemble(config_of("mill"));
  SimulationResult result;
  result.joints.resize(assembly.machine.joints.size());
  EXPECT_EQ(broken_promises(result, assembly.machine), "");
  result.joints[1].peaks[static_cast<std::size_t>(Quantity::kJerk)] = {1, 1.5, 0.25, 7, 3, 0};
  result.deviation.tip_over_mm = {0.002, 12};
  const std::string text = broken_promises(result, assembly.machine);
  EXPECT_NE(text.find("line 7: joint Y went to 1.500000 of its limit of jerk"), std::string::npos) << text;
  EXPECT_NE(text.find("line 12: the tool tip is 0.002000 mm farther off"), std::string::npos) << text;
}

// Where rounding alone decided on which side of a sample its nearest place on an arc lies, the search for
// that place went on by halving what was left and gave up far from it.
TEST(RunPromises, ASampleOnAnArcFarFromTheOriginIsNoDeviation) {
  Assembly assembly = assemble(config_of("head_table"));
  Reports reports;
  const SimulationResult result = run(assembly,
                                      "G21 G17 G40 G49 G90 G94\nG64 P0.01098\nM428\n"
                                      "G1 X20.9028 B-7.0756 C9.8735 F209.028\n"
                                      "G1 X22.9107 Y2.6321 Z-4.2057 C5.1492 F13111.791\n"
                                      "G2 X23.1208 Y0.9387 Z-4.2057 I0.6566 J-0.7783 F2438.177\n"
                                      "G1 Y0.6207 Z-4.6015\nG4 P0.01\n"
                                      "G1 Z-35.9313 B-48.6586 C31.4706 F313.298\n"
                                      "G1 Y15.7358 Z-37.2169 B-45.4121 F272.567\nG64 P0.00093\n"
                                      "G1 X14.2813 F7993.934\n"
                                      "G3 X14.2890 Y15.6504 Z-38.2096 I0.8081 J0.0302 F272.567\nM2\n",
                                      reports);
  EXPECT_LE(result.deviation.tip_ratio.value, 1);
  EXPECT_FALSE(result.deviation.broken()) << broken_promises(result, assembly.machine);
}

// The speed at a slow block of 10 um between fast ones answers so little to what its bound is lowered by that
// ten rounds were not enough.
TEST(RunPromises, ASlowBlockBetweenRapidsNeedsNoStopOfThePlan) {
  Assembly assembly = assemble(config_of("cradle"));
  Reports reports;
  const SimulationResult result = run(assembly,
                                      "G21 G17 G40 G49 G90 G94\n"
                                      "G0 X58.4580 Y11.5195 Z-53.1615 A3.2291 C-8.7135\n"
                                      "G0 X58.4509 Y11.5256 Z-53.1615 A3.2291 C-8.7125\n"
                                      "G1 X58.4438 Y11.5317 Z-53.1615 A3.2291 C-8.7116 F90.803\n"
                                      "G1 X58.4366 Y11.5378 Z-53.1615 A3.2291 C-8.7106 F2071.840\n"
                                      "G1 X58.4295 Y11.5439 Z-53.1615 A3.2291 C-8.7097 F2011.042\n"
                                      "G1 X58.4224 Y11.5500 Z-53.1615 A3.2291 C-8.7088 F2071.840\n"
                                      "G0 X58.4152 Y11.5561 Z-53.1615 A3.2291 C-8.7078\n"
                                      "G93 G1 X58.4009 Y11.5683 Z-53.1615 A3.2291 C-8.7060 F391.2042\nM2\n",
                                      reports);
  EXPECT_EQ(result.speed.fallbacks, 0u);
}

// The last line but one is slow, and short beside the blend in front of it: there the speed falls by a
// quarter only of what its bound is lowered by, and ten rounds were not enough.
TEST(PlanStops, NoneWhereASlowLineIsShort) {
  for (int seed = 0; seed < 40; ++seed) {
    std::mt19937_64 rng(static_cast<unsigned>(seed));
    std::uniform_real_distribution<double> unit(-1, 1);
    const double feed = seed == 0 ? 44.44 : 44.44 * std::exp(unit(rng));
    const std::string text = fmt::format(
        "G21 G90 G94\nG1 X-4.8923 Y-15.6419 Z-5.9765 B-16.1008 C-0.2226 F573.222\nX-4.8805 Y-15.6489\n"
        "G91 G0 X0.0119 Y-0.0067\nG90 G1 X-4.8567 Y-15.6620\nX-4.8447 Y-15.6681\nX-4.8327 Y-15.6739 "
        "F1525.821\n"
        "X-4.8206 Y-15.6795 F573.222\nX-4.8084 Y-15.6848 F{:.4f}\nG0 X-4.7962 Y-15.6898\nM2\n",
        feed);
    EXPECT_EQ(test::run_text(test::config_of("head_table"), text).result.speed.fallbacks, 0u) << "F" << feed;
  }
}

// Where the jerk's excess does not go, the speed is lowered. Beside a slow line, whose bound holds for the
// interval before it too, it was lowered to a thousandth, and no round kept the jerk any more. The program,
// and neighbours that are faster or slower in that line and elsewhere.
TEST(PlanStops, NoneWhereTurningComesToASlowLine) {
  for (int seed = 0; seed < 60; ++seed) {
    std::mt19937_64 rng(static_cast<unsigned>(seed));
    std::uniform_real_distribution<double> unit(-1, 1);
    const double slow = seed == 0 ? 105.187 : 105.187 * std::exp(unit(rng)),
                 fast = seed == 0 ? 4218.817 : 4218.817 * std::exp(unit(rng) / 2);
    const std::string text = fmt::format(
        "G21 G17 G40 G49 G90 G94\n"
        "G94 G90 G1 X46.796213 Y-21.511637 Z-57.878688 B86.332982 C191.698819 F{1:.3f}\n"
        "G90 G0 X46.796213 Y-22.296772 Z-56.468479 B86.332982 C192.617333\n"
        "G93 G90 G1 X46.796213 Y-22.500354 Z-55.990484 B86.332982 C192.877144 F263.050913\n"
        "G94 G90 G1 X46.796213 Y-22.673020 Z-55.512568 B86.332982 C193.111472 F{1:.3f}\n"
        "G93 G91 G1 X0.000000 Y-0.140871 Z0.475406 B0.000000 C0.207651 F1663.671089\n"
        "G94 G90 G1 X46.796213 Y-22.922250 Z-54.566686 B86.332982 C193.499042 F{1:.3f}\n"
        "G94 G90 G1 X46.796213 Y-22.997546 Z-54.103531 B86.332982 C193.650312 F{1:.3f}\n"
        "G94 G90 G1 X46.796213 Y-23.039396 Z-53.650056 B86.332982 C193.772165 F{1:.3f}\n"
        "G94 G90 G1 X46.796213 Y-23.047586 Z-53.208567 B86.332982 C193.863980 F{0:.3f}\n"
        "G94 G90 G1 X46.796213 Y-23.022076 Z-52.781310 B86.332982 C193.925290 F{1:.3f}\n"
        "G94 G90 G1 X46.796213 Y-22.962996 Z-52.370459 B86.332982 C193.955783 F{1:.3f}\n"
        "G94 G90 G1 X46.796213 Y-22.870644 Z-51.978105 B86.332982 C193.955304 F{1:.3f}\n"
        "G94 G90 G1 X46.796213 Y-22.745492 Z-51.606243 B86.332982 C193.923856 F{1:.3f}\n"
        "G90 G0 X46.796213 Y-22.588177 Z-51.256766 B86.332982 C193.861598\n"
        "G94 G90 G1 X46.796213 Y-22.399498 Z-50.931451 B86.332982 C193.768848 F{1:.3f}\n"
        "G94 G90 G1 X46.796213 Y-22.180415 Z-50.631954 B86.332982 C193.646077 F{1:.3f}\n"
        "G90 G0 X46.796213 Y-21.024540 Z-49.720491 B86.332982 C192.869495\n"
        "G90 G0 X46.796202 Z-49.722035 B86.332983\n"
        "G94 G90 G1 X46.796203 Y-21.025380 B86.332983 F{1:.3f}\n"
        "M2\n",
        slow, fast);
    EXPECT_EQ(test::run_text(test::config_of("head_table"), text).result.speed.fallbacks, 0u)
        << "F" << slow << " in F" << fast;
  }
}

// A fast way to an arc at 0.8 mm/s. The solver's first guess led nowhere, and the machine stopped before it.
// The program, and neighbours that are faster or slower in that arc and elsewhere.
TEST(PlanStops, NoneBeforeAPlaceThatIsHundredsOfTimesSlower) {
  for (int seed = 0; seed < 40; ++seed) {
    std::mt19937_64 rng(static_cast<unsigned>(seed));
    std::uniform_real_distribution<double> unit(-1, 1);
    const double slow = seed == 0 ? 48.183 : 48.183 * std::exp(unit(rng)),
                 fast = seed == 0 ? 6845.153 : 6845.153 * std::exp(unit(rng) / 2);
    const std::string text = fmt::format(
        "G21 G17 G40 G49 G90 G94\n"
        "G94 G90 G1 X0.9536 Y5.1878 Z-301.5715 F2953.443\n"
        "G90 G0 X6.1852 Y8.1114 Z-309.0387\n"
        "G94 G90 G1 X6.2146 Y8.0957 Z-309.0792 F24.486\n"
        "G94 G90 G1 X10.4895 Y5.8145 Z-314.9698 F4239.019\n"
        "G94 G90 G1 X15.9518 Y-0.7258 Z-348.8421 A-0.3312 F{1:.3f}\n"
        "G94 G17 G90 G2 X15.9018 Y-0.3691 Z-349.7411 I0.4485 J0.2447 F{0:.3f}\n"
        "G93 G17 G90 G2 X18.5720 Y-1.2020 Z-349.7411 I1.1691 J-0.9486 F570.1579\n"
        "G93 G17 G90 G2 X3.0279 Y-8.9464 Z-349.7411 I-9.3425 J-0.7201 F627.1291\n"
        "G94 G17 G90 G3 X2.2495 Y-9.6071 Z-349.7411 I-0.3414 J-0.3867 F{1:.3f}\n"
        "G90 G0 X2.3439 Y-9.6682\n"
        "G94 G90 G1 X37.6735 Y-1.9471 A-4.1353 F{1:.3f}\n"
        "M2\n",
        slow, fast);
    for (const char* const config : {"rail_mill", "rail_mill_measured"})
      EXPECT_EQ(test::run_text(test::config_of(config), text).result.speed.fallbacks, 0u)
          << config << " F" << slow << " in F" << fast;
  }
}

TEST(RunPromises, AChangeOfToolsIsNoDeviation) {
  Assembly assembly = assemble(config_of("cradle_measured"));
  Reports reports;
  const SimulationResult result =
      run(assembly,
          "G21 G90 G64 P0.01\nT3 M6 G43 H3\nM428\nG1 X5 Y5 Z120 A10 F3000\nG1 X6 C20\nG43 H1\nG1 X9 Y2 A12\n"
          "M429\nG49\nG1 X3 A0 C0\nM2\n",
          reports);
  EXPECT_LE(result.deviation.tip_ratio.value, 1);
  EXPECT_LT(result.deviation.tip_mm.value, 0.01);
  EXPECT_EQ(result.deviation.lost, 0u);
  EXPECT_FALSE(result.deviation.broken()) << broken_promises(result, assembly.machine);
}

// Line 11 takes 0.78 s for 0.1 mm. The program, and neighbours whose windows end elsewhere in it: longer ways
// there, other times. A window that ended just inside that line came to its rest at a creep, which counted as
// room to brake.
TEST(PlanStops, NoneWhereAWindowEndsInASlowPlace) {
  for (int seed = 0; seed < 60; ++seed) {
    std::mt19937_64 rng(static_cast<unsigned>(seed));
    std::uniform_real_distribution<double> unit(-1, 1);
    const double longer = seed == 0 ? 0 : 12 * unit(rng), slower = seed == 0 ? 1 : std::exp(unit(rng));
    const std::string text = fmt::format(
        "G21 G90\nG64 P0.03901\nG93 G1 X{:.4f} Y26.5255 Z29.6344 A47.9773 C-0.1281 F34.7733\n"
        "X18.0207 Y26.4760 Z29.5821 A47.9829 F866.1894\nG0 X18.0532 Y26.4261 Z29.5277 A47.9889\n"
        "G94 G1 X18.1218 Y26.3251 Z29.4126 A48.0025 F31858.730\nX18.1579 Y26.2741 Z29.3520 A48.0100 "
        "F7025.161\n"
        "X18.2336 Y26.1710 Z29.2249 A48.0264 F8436.518\nX18.2732 Y26.1190 Z29.1584 A48.0354 F2599.789\n"
        "X18.3139 Y26.0668 Z29.0900 A48.0447 F8436.518\n"
        "G93 X18.3556 Y26.0143 Z29.0197 A48.0546 F{:.4f}\n"
        "G94 X18.4423 Y25.9088 Z28.8737 A48.0756 F2115.781\nG93 X18.8283 Y25.4827 Z28.2222 A48.1768 "
        "F44.6880\n"
        "G94 G17 G2 X14.2628 Y17.2206 Z28.2222 I-9.1963 J-0.3107 F8436.518\nM2\n",
        17.9894 + longer, 76.966 / slower);
    EXPECT_EQ(test::run_text(test::config_of("head"), text).result.speed.fallbacks, 0u) << "seed " << seed;
  }
}

}  // namespace
}  // namespace trn

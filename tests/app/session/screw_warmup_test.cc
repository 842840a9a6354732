#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "app/session/assembly.h"
#include "app/session/simulation.h"
#include "compensation/sensor_board.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/frames.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/rt_messages.h"
#include "sim/simulated_screws.h"
#include "tests/app/session/machine_run.h"
#include "tests/compensation/true_screw.h"
#include "tests/support/rounds.h"

// Machining that warms the ball screws of the head, through the whole kernel. What the screws really do comes
// from a heat equation of its own (finer, implicit, with other friction and cooling than the model has).
namespace trn {
namespace {

using test::config_of;
using test::text_of;
using test::TrueScrew;
using test::written;

constexpr double kBearing[] = {-1050, -650, -450}, kLength[] = {2100, 1300, 1100};
constexpr double kAir_C = 20;

std::string screws(bool sensors, const char* on_dropout) {
  std::string out = "\n[corrections.screw]\nlimit_mm = 0.6\nreserve = 0.005\n";
  for (int i = 0; i < 3; ++i) {
    out += fmt::format(
        "[[corrections.screw.axis]]\njoint = \"{}\"\nmounting = \"fixed-free\"\nfixed_bearing_mm = {}\n"
        "far_bearing_mm = {}\n",
        "XYZ"[i], kBearing[i], kBearing[i] + kLength[i]);
    if (sensors)
      out += fmt::format("sensor = \"screw {}\"\nsensor_at_mm = {}\non_dropout = \"{}\"\n", "XYZ"[i],
                         -kBearing[i], on_dropout);
  }
  return out;
}

/// Long strokes of X, Y and Z, about 29 s a pass, and the published lines N73 to N75 in every pass.
std::string machining(int passes) {
  return fmt::format(
      "G21 G17 G40 G49 G80 G90 G94\nT1 M6\n#1=0\no100 while [#1 LT {}]\n"  // 1 to 4
      "G64 P0.05\nF12000\n#2=0\no110 while [#2 LT 6]\nG1 X250 Y[20*#2] Z-100\nG1 X-150 Y[200-20*#2]\n"  // to
                                                                                                        // 10
      "#2=[#2+1]\no110 endwhile\nG1 Z60 F9000\nG43.4 H1\nG61\n"                                  // to 15
      "G1 X76.281 Y59.637 Z14.12 A22.18 C40.96 F6000\nF600\n"                                    // 16, 17
      "N74 G1 X76.281 Y59.637 Z14.12 A21.62 C41.63\nN75 X76.281 Y59.637 Z14.12 A20.68 C42.19\n"  // 18, 19
      "G0 Z60\nG49\n#1=[#1+1]\no100 endwhile\nM2\n",
      passes);
}
constexpr std::uint32_t kN74 = 18, kN75 = 19;

struct Errors {
  double direct_um = 0, indirect_um = 0;
  void widen(const Errors& other) {
    direct_um = std::max(direct_um, other.direct_um);
    indirect_um = std::max(indirect_um, other.indirect_um);
  }
};

struct Truth {
  double friction = 1.05, cooling = 0.95;  ///< over what the model believes
  double silent_from_s = 0, silent_to_s = 0, absurd_from_s = 0, absurd_to_s = 0;
};

/// Three real screws: they warm up, feed the sensors, and tell what the nuts miss.
class WarmMachine final : public ReportSink {
 public:
  WarmMachine(const Truth& truth, SensorBoard& board) : truth_(truth), board_(board) {
    for (const double length : kLength)
      screws_.emplace_back(length, 120 * truth.friction, 25 * truth.friction, 12 * truth.cooling);
  }
  void write(const CycleReport& report) override {
    for (int i = 0; i < 3; ++i) {
      const double x = report.q_setpoint[i] - kBearing[i];
      if (periods_ > 0) screws_[static_cast<std::size_t>(i)].move(x, std::abs(x - last_[i]));
      last_[i] = x;
    }
    const JointVec& offset = report.corrections[0].offset;
    if (offset.size() > 0 && offset_.size() > 0)
      step_um = std::max(step_um, 1000 * (offset - offset_).lpNorm<Eigen::Infinity>());
    offset_ = offset;
    measure(report);
    if (++periods_ % 50 == 0)
      for (TrueScrew& screw : screws_) screw.step(0.05);
    if (periods_ % 1000 == 0) publish(static_cast<double>(periods_) / 1000);
    if (periods_ % 600000 == 0) tell();
  }
  double now_s() const { return static_cast<double>(periods_) / 1000; }

  Errors before, left;  ///< worst of all
  double step_um = 0;   ///< greatest change of an offset in one period

 private:
  void measure(const CycleReport& report) {
    if (!report.on_path) return;
    Vec3 without, with;
    for (int i = 0; i < 3; ++i) {
      const TrueScrew& screw = screws_[static_cast<std::size_t>(i)];
      const double plan = report.q_plan[i] - kBearing[i], x = report.q_setpoint[i] - kBearing[i];
      without[i] = 1000 * screw.displacement(plan);
      with[i] = 1000 * (x + screw.displacement(x) - plan);
    }
    const bool only_turning = report.line == kN74 || report.line == kN75;
    if (only_turning && !turning_) start_ = {without, with};
    turning_ = only_turning;
    const Errors off{without.norm(), only_turning ? (without - start_.first).norm() : 0};
    const Errors on{with.norm(), only_turning ? (with - start_.second).norm() : 0};
    before.widen(off);
    left.widen(on);
    window_before_.widen(off);
    window_left_.widen(on);
  }
  void publish(double t) {
    if (t >= truth_.silent_from_s && t < truth_.silent_to_s) return;
    const bool absurd = t >= truth_.absurd_from_s && t < truth_.absurd_to_s;
    for (int i = 0; i < 3; ++i) {
      const int channel = board_.find(fmt::format("screw {}", "XYZ"[i]));
      const double celsius = kAir_C + screws_[static_cast<std::size_t>(i)].rise_at(-kBearing[i]);
      if (channel >= 0) board_.publish(channel, absurd && i == 1 ? 999 : celsius);
    }
  }
  void tell() {
    std::printf(
        "  %2.0f min: direct %7.2f um without, %6.3f um with; indirect %.4f um without, %.5f um with\n",
        now_s() / 60, window_before_.direct_um, window_left_.direct_um, window_before_.indirect_um,
        window_left_.indirect_um);
    window_before_ = window_left_ = {};
  }

  Truth truth_;
  SensorBoard& board_;
  std::vector<TrueScrew> screws_;
  std::uint64_t periods_ = 0;
  double last_[3] = {};
  JointVec offset_;
  bool turning_ = false;
  std::pair<Vec3, Vec3> start_;
  Errors window_before_, window_left_;
};

struct Outcome {
  Errors before, left;
  double step_um = 0;
  std::string warning;
};

Outcome machine_for(int passes, const std::string& config, const Truth& truth) {
  Assembly assembly = assemble(config);
  WarmMachine machine(truth, *assembly.corrections.sensors);
  SimulationOptions options;
  options.program = written("machining.ngc", machining(passes));
  options.trace = &machine;
  Parameters parameters;
  ToolTable tools = ToolTable::parse("T1 P1 Z+100 D6\n", "t.tbl");
  const SimulationResult result = simulate(assembly, parameters, tools, options);
  EXPECT_EQ(result.fault, Fault::kOk);
  EXPECT_TRUE(result.within_limits);
  const std::string warning = result.corrections.empty() ? "" : result.corrections.back().warning;
  std::printf(
      "%.1f min at %.0f times real time: direct %.2f um without, %.3f um left (%.2f %%); indirect %.4f um "
      "without, %.5f um left (%.2f %%)\n",
      machine.now_s() / 60, result.cycle_time_s / result.wall_s, machine.before.direct_um,
      machine.left.direct_um, 100 * machine.left.direct_um / machine.before.direct_um,
      machine.before.indirect_um, machine.left.indirect_um,
      100 * machine.left.indirect_um / machine.before.indirect_um);
  return {machine.before, machine.left, machine.step_um, warning};
}

/// An hour in the long form.
int passes() { return test::long_form() ? 125 : 4; }

std::string head_with(const std::string& text) {
  return written("warm_head.toml", text_of(config_of("head")) + text);
}

/// What is left is how the profiles fade in, some nanometres; after minutes that is not yet small beside the
/// error.
void judge_indirect(const Outcome& out) {
  EXPECT_LT(out.left.indirect_um, 0.03);
  if (test::long_form()) {
    EXPECT_LT(out.left.indirect_um, 0.1 * out.before.indirect_um);
  }
}

TEST(ScrewWarmUp, ModelOnly) {
  const Outcome plain = machine_for(2, config_of("head"), {});
  const Outcome two = machine_for(2, head_with(screws(false, "model")), {});
  // The error that the run with correction says it would have had without is the one a run without has.
  EXPECT_NEAR(two.before.direct_um, plain.left.direct_um, 0.02 * plain.left.direct_um);
  EXPECT_NEAR(two.before.indirect_um, plain.left.indirect_um, 0.02 * plain.left.indirect_um);
  const Outcome out = machine_for(passes(), head_with(screws(false, "model")), {});
  EXPECT_LT(out.left.direct_um, 0.1 * out.before.direct_um);
  judge_indirect(out);
}

TEST(ScrewWarmUp, WithSensors) {
  const Outcome out = machine_for(passes(), head_with(screws(true, "model")), {1.3, 1.1});
  EXPECT_LT(out.left.direct_um, 0.1 * out.before.direct_um);  // the model alone would miss 23 %
  judge_indirect(out);
  EXPECT_EQ(out.warning, "");
}

// Sensors fall silent for 15 s of 40, one reads nonsense for 5 s: named, and nothing jumps.
TEST(ScrewWarmUp, SensorsThatFail) {
  for (const char* on_dropout : {"model", "hold"}) {
    Truth truth{1.05, 0.95, 12, 28, 0, 0};
    const Outcome silent = machine_for(4, head_with(screws(true, on_dropout)), truth);
    EXPECT_NE(silent.warning.find("sensor screw "), std::string::npos) << silent.warning;
    EXPECT_NE(silent.warning.find("silent"), std::string::npos) << silent.warning;
    truth = {1.05, 0.95, 0, 0, 20, 25};
    const Outcome absurd = machine_for(4, head_with(screws(true, on_dropout)), truth);
    EXPECT_NE(absurd.warning.find("sensor screw Y reads nonsense"), std::string::npos) << absurd.warning;
    for (const Outcome* out : {&silent, &absurd}) {
      // At 200 mm/s the growth follows the axis by 5e-4 of it at most; a profile changes by 5 um/s.
      EXPECT_LT(out->step_um, 0.1 + 0.02);
      EXPECT_LT(out->left.direct_um, 0.5 * out->before.direct_um);
    }
  }
}

// The screws of the simulated machine, as the shipped config has them: three mountings, sensors with 0.1 K, a
// model.
TEST(ScrewWarmUp, TheSimulatedMachineTellsWhatItsScrewsDid) {
  Assembly assembly = assemble(config_of("head_screws"));
  SimulationOptions options;
  options.program = written("machining.ngc", machining(4));
  Parameters parameters;
  ToolTable tools = ToolTable::parse("T1 P1 Z+100 D6\n", "t.tbl");
  const SimulationResult result = simulate(assembly, parameters, tools, options);
  EXPECT_TRUE(result.within_limits);
  ASSERT_EQ(result.screws.size(), 3u);
  for (const SimulatedScrews::Report& screw : result.screws) {
    std::printf("joint %d: %.2f K, %.3f um without, %.3f um left\n", screw.joint, screw.rise_K,
                1000 * screw.worst.without, 1000 * screw.worst.left);
    EXPECT_GT(screw.rise_K, 0.1);
    EXPECT_LT(screw.worst.left, screw.joint == 0 ? 0.5 * screw.worst.without : 0.001);
  }
  EXPECT_GT(result.screws[0].worst.without, 0.003);  // the free end; the others hold what they can
  EXPECT_EQ(result.corrections.back().warning, "");
}

}  // namespace
}  // namespace trn

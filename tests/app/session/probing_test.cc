#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/simulation.h"
#include "core/config.h"
#include "core/fault.h"
#include "core/frames.h"
#include "core/units.h"
#include "interp/gcode/error.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"
#include "tests/support/paths.h"
#include "tests/support/rounds.h"

// The routines of examples/probing on simulated shapes, whose place, size and angle are known.
namespace trn {
namespace {

constexpr double kTip = 3;  // diameter of the stylus' ball, mm
// A contact is the joints' place at the end of the period that meets the surface: at most the way of one
// period beyond it, here at the routines' own 30 mm/min.
constexpr double kStep = 30.0 / 60 * 0.001;
constexpr double kRounding = 1e-6;

/// Where the work offset lies, and in which units the program is.
struct WorkOffset {
  Vec3 origin = Vec3::Zero();
  double rotation_deg = 0;
  bool inch = false;
  double unit_mm() const { return inch ? 25.4 : 1; }
  /// A shape's frame at `p` (program coordinates, mm), turned about Z by `deg`, as keys of the config.
  std::string frame(const Vec3& p, double deg) const {
    const Vec3 at = origin + rot_z(rotation_deg * kRadPerDeg) * p;
    return fmt::format("at_mm = [{:.12f}, {:.12f}, {:.12f}]\nturn_deg = [{:.12f}, 0.0, 0.0]\n", at.x(),
                       at.y(), at.z(), rotation_deg + deg);
  }
};

/// Places that differ from test to test, the same at every run.
class Lots {
 public:
  explicit Lots(unsigned seed) : random_(seed) {}
  double between(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  WorkOffset work_offset() {
    WorkOffset out;
    out.origin = Vec3(between(-20, 20), between(-20, 20), between(-30, 10));
    out.rotation_deg = between(-40, 40);
    out.inch = between(0, 1) > 0.5;
    return out;
  }

 private:
  std::mt19937 random_;
};

/// A program on the mill, or another machine, with shapes on its table.
class Probing {
 public:
  Probing(const WorkOffset& setup, const std::string& shapes, std::string calls,
          const std::string& machine = "mill")
      : setup_(setup), assembly_(assemble(parse_config(config(shapes, machine), "probing.toml"))) {
    Tool& tool = tools_.at_or_new(1);
    tool.offset.xyz = Vec3(0, 0, 40);
    options_.program = "probing.ngc";
    options_.program_text = head() + std::move(calls) + "M2\n";
    options_.on_message = [this](std::string_view text, std::uint32_t) { said.emplace_back(text); };
    try {
      result = simulate(assembly_, parameters, tools_, options_);
    } catch (const ProgramError& refused) {
      error = refused.what();
    }
  }
  /// #n of the program, a length in mm.
  double mm(int n) const { return parameters[n] * setup_.unit_mm(); }
  const ToolTable& tools() const { return tools_; }

  Parameters parameters;
  SimulationResult result;
  std::string error;
  std::vector<std::string> said;

 private:
  static std::string config(const std::string& shapes, const std::string& machine) {
    std::ifstream in(source_dir() + "/configs/" + machine + ".toml");
    std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    text.resize(std::min(text.size(), text.find("\n[io]")));
    const std::string program = "[program]\n";
    text.insert(text.find(program) + program.size(),
                fmt::format("sub_path = [\"{}/examples/probing\"]\n", source_dir()));
    return text + fmt::format("\n[io]\n[io.probe]\ntip_diameter_mm = {}\nlength_mm = 40\n", kTip) + shapes;
  }
  std::string head() const {
    const Vec3& o = setup_.origin;
    return fmt::format(
        "G21 G90 G17\nG10 L2 P1 X{:.12f} Y{:.12f} Z{:.12f} R{:.12f}\nG54\nT1 M6\nG43\n{}\n"
        "#<_probe_tip_diameter> = {:.15f}\n",
        o.x(), o.y(), o.z(), setup_.rotation_deg, setup_.inch ? "G20" : "G21", kTip / setup_.unit_mm());
  }

  WorkOffset setup_;
  Assembly assembly_;
  ToolTable tools_;
  SimulationOptions options_;
};

/// G0 to a place in mm, in the program's units: over it first.
std::string to(const WorkOffset& s, const Vec3& p, double above = 30) {
  const Vec3 u = p / s.unit_mm();
  return fmt::format("G0 Z{:.9f}\nG0 X{:.9f} Y{:.9f}\nG0 Z{:.9f}\n", (p.z() + above) / s.unit_mm(), u.x(),
                     u.y(), u.z());
}
std::string words(const WorkOffset& s, std::initializer_list<double> lengths) {
  std::string out;
  for (const double length : lengths) out += fmt::format("[{:.9f}] ", length / s.unit_mm());
  return out;
}

/// The worst error of each routine against the truth, printed at the end of the long form.
class Worst : public testing::Environment {
 public:
  static void note(const std::string& what, double error) {
    double& worst = all()[what];
    worst = std::max(worst, std::abs(error));
  }
  void TearDown() override {
    if (!test::long_form()) return;
    for (const auto& [what, worst] : all()) std::printf("%-28s %.5f\n", what.c_str(), worst);
  }

 private:
  static std::map<std::string, double>& all() {
    static std::map<std::string, double> worst;
    return worst;
  }
};
testing::Environment* const kWorst = testing::AddGlobalTestEnvironment(new Worst);

class ProbingAt : public testing::TestWithParam<unsigned> {};
INSTANTIATE_TEST_SUITE_P(Seeds, ProbingAt,
                         testing::Range(1u, test::long_form() ? 61u
                                                              : 1u + static_cast<unsigned>(test::brief(5))));

void expect_done(const Probing& run) {
  EXPECT_EQ(run.error, "");
  EXPECT_EQ(run.result.fault, Fault::kOk);
  EXPECT_TRUE(run.result.within_limits);
}

// From each of the four sides, and from above. A touch ends up to a step inside the surface, in the touch's
// direction, never before it.
TEST_P(ProbingAt, EdgesAndHeight) {
  Lots lots(GetParam());
  const WorkOffset s = lots.work_offset();
  const Vec3 top(lots.between(-20, 20), lots.between(-20, 20), lots.between(-40, -20));
  const Vec3 half(lots.between(8, 20), lots.between(8, 20), 15);
  const std::string plate = "[[io.plate]]\n" + s.frame(top, 0) +
                            fmt::format("min_mm = [{0}, {1}, -30]\nmax_mm = [{2}, {3}, 0]\n", -half.x(),
                                        -half.y(), half.x(), half.y());
  std::string calls = to(s, top + Vec3(1, 2, 9));
  calls += "o<probe_height> call " + words(s, {9}) + "[0]\n#100 = #<_probe_z>\n";
  for (int k = 0; k < 4; ++k) {
    const int axis = k / 2;
    const double sign = k % 2 ? -1 : 1;
    Vec3 at = top + Vec3(1, 2, -6);
    at[axis] = top[axis] - sign * (half[axis] + 7);
    calls += to(s, at) + fmt::format("o<probe_edge> call [{}] {} [0]\n#{} = #<_probe_{}>\n", axis,
                                     words(s, {sign * 5}), 101 + k, "xy"[axis]);
    calls += fmt::format("#{} = #5420\n#{} = #5421\n#{} = #5422\n", 111 + 3 * k, 112 + 3 * k, 113 + 3 * k);
    calls += to(s, at + Vec3(0, 0, 40), 0);
  }
  const Probing run(s, plate, calls);
  expect_done(run);
  EXPECT_LE(run.mm(100), top.z() + kRounding);
  EXPECT_GE(run.mm(100), top.z() - kStep - kRounding);
  Worst::note("height, um", 1000 * (run.mm(100) - top.z()));
  for (int k = 0; k < 4; ++k) {
    const int axis = k / 2;
    const double sign = k % 2 ? -1 : 1;
    const double inside = sign * (run.mm(101 + k) - (top[axis] - sign * half[axis]));
    EXPECT_GE(inside, -kRounding) << k;
    EXPECT_LE(inside, kStep + kRounding) << k;
    Worst::note("edge, um", 1000 * inside);
    // It stands where it began.
    EXPECT_NEAR(run.mm(111 + 3 * k + axis), top[axis] - sign * (half[axis] + 7), kRounding);
    EXPECT_NEAR(run.mm(113 + 3 * k), top.z() - 6, kRounding);
  }
}

// Four touches, each up to a step deep. The line through two that lie a and a + 12 mm from the corner is off
// there by (a + 12) / 12 of one or a / 12 of the other at the most, and the corner lies on two such lines.
// Outside a is 8 mm at the most, inside 18.
TEST_P(ProbingAt, CornersOfATurnedPart) {
  Lots lots(100 + GetParam());
  const WorkOffset s = lots.work_offset();
  const double turn = lots.between(-8, 8);
  const Vec3 corner(lots.between(-20, 20), lots.between(-20, 20), -20);
  // A part that lies to X+ Y+ of the corner, and one whose pocket lies there.
  const std::string solid =
      "[[io.plate]]\n" + s.frame(corner, turn) + "min_mm = [0, 0, -30]\nmax_mm = [50, 60, 0]\n";
  const std::string pocket = "[[io.plate]]\n" + s.frame(corner, turn) +
                             "min_mm = [-20, -20, -30]\nmax_mm = [0, 80, 0]\n[[io.plate]]\n" +
                             s.frame(corner, turn) + "min_mm = [-20, -20, -30]\nmax_mm = [60, 0, 0]\n";
  const auto measured = [&](const std::string& shapes, double sign) {
    const std::string calls =
        to(s, corner + Vec3(-sign * 9, -sign * 8, -5)) + "o<probe_corner> call " +
        words(s, {sign > 0 ? 7.5 : -7.5, sign > 0 ? 6.5 : -6.5, 8 + (sign < 0 ? 9.0 : 0), 12}) +
        fmt::format("[{}] [0]\n", sign > 0 ? 0 : 1) +
        "#101 = #<_probe_x>\n#102 = #<_probe_y>\n#103 = #<_probe_angle>\n#104 = "
        "#<_probe_square>\n";
    return Probing(s, shapes, calls);
  };
  for (const bool inside : {false, true}) {
    const Probing run = measured(inside ? pocket : solid, inside ? -1 : 1);
    expect_done(run);
    const double bound = std::sqrt(2.0) * ((inside ? 30.0 : 20.0) / 12) * kStep + kRounding;
    EXPECT_NEAR(run.mm(101), corner.x(), bound) << inside;
    EXPECT_NEAR(run.mm(102), corner.y(), bound) << inside;
    Worst::note(inside ? "corner inside, um" : "corner outside, um",
                1000 * std::hypot(run.mm(101) - corner.x(), run.mm(102) - corner.y()));
    Worst::note("corner, angle, deg", run.parameters[103] - turn);
    EXPECT_NEAR(run.parameters[103], turn, kStep / 12 * kDegPerRad * 1.01) << inside;
    EXPECT_NEAR(run.parameters[104], 90, 2 * kStep / 12 * kDegPerRad * 1.01) << inside;
  }
}

TEST_P(ProbingAt, BoreAndBoss) {
  Lots lots(200 + GetParam());
  const WorkOffset s = lots.work_offset();
  const Vec3 middle(lots.between(-15, 15), lots.between(-15, 15), -20);
  const double d = lots.between(12, 30);
  const Vec3 off(lots.between(-1.5, 1.5), lots.between(-1.5, 1.5), 0);
  const std::string results =
      "#101 = #<_probe_x>\n#102 = #<_probe_y>\n#103 = #<_probe_diameter>\n#104 = "
      "#<_probe_round>\n";
  const std::string bore = "[[io.plate]]\n" + s.frame(middle, 20) +
                           fmt::format(
                               "min_mm = [-30, -30, -30]\nmax_mm = [30, 30, 0]\n[[io.plate.bore]]\nx_mm = "
                               "0\ny_mm = 0\ndiameter_mm = {}\ndepth_mm = 20\n",
                               d);
  const std::string boss =
      "[[io.boss]]\n" + s.frame(middle, 0) + fmt::format("diameter_mm = {}\nheight_mm = 25\n", d);
  const Probing in_bore(
      s, bore,
      to(s, middle + off - Vec3(0, 0, 8)) + "o<probe_bore> call " + words(s, {d + 0.4}) + "[0]\n" + results);
  const Probing at_boss(s, boss,
                        to(s, middle + off + Vec3(0, 0, 6)) + "o<probe_boss> call " +
                            words(s, {d - 0.4, 12, 5}) + "[0]\n" + results);
  for (const Probing* run : {&in_bore, &at_boss}) {
    expect_done(*run);
    // The touches along Y are as far beside the middle as the first two along X say: that shortens the way by
    // less than a nanometre.
    EXPECT_NEAR(run->mm(101), middle.x(), kStep / 2 + kRounding);
    EXPECT_NEAR(run->mm(102), middle.y(), kStep / 2 + kRounding);
    EXPECT_NEAR(run->mm(104), 0, 2 * kStep + kRounding);
    const std::string name = run == &in_bore ? "bore" : "boss";
    Worst::note(name + ", middle, um",
                1000 * std::hypot(run->mm(101) - middle.x(), run->mm(102) - middle.y()));
    Worst::note(name + ", diameter, um", 1000 * (run->mm(103) - d));
  }
  EXPECT_GE(in_bore.mm(103), d - kRounding);
  EXPECT_LE(in_bore.mm(103), d + 2 * kStep + kRounding);
  EXPECT_LE(at_boss.mm(103), d + kRounding);
  EXPECT_GE(at_boss.mm(103), d - 2 * kStep - kRounding);
}

TEST_P(ProbingAt, WebAndPocket) {
  Lots lots(300 + GetParam());
  const WorkOffset s = lots.work_offset();
  const Vec3 middle(lots.between(-10, 10), lots.between(-10, 10), -20);
  const double wx = lots.between(12, 30), wy = lots.between(12, 30);
  const std::string results =
      "#101 = #<_probe_x>\n#102 = #<_probe_y>\n#103 = #<_probe_width_x>\n#104 = #<_probe_width_y>\n";
  const std::string block =
      "[[io.plate]]\n" + s.frame(middle, 0) +
      fmt::format("min_mm = [{0}, {1}, -30]\nmax_mm = [{2}, {3}, 0]\n", -wx / 2, -wy / 2, wx / 2, wy / 2);
  std::string walls;
  for (const double sign : {-1.0, 1.0})
    for (const bool along_x : {true, false}) {
      Vec3 low(-40, -40, -30), high(40, 40, 0);
      const int k = along_x ? 0 : 1;
      (sign > 0 ? low : high)[k] = sign * (along_x ? wx : wy) / 2;
      walls += "[[io.plate]]\n" + s.frame(middle, 0) +
               fmt::format("min_mm = [{}, {}, {}]\nmax_mm = [{}, {}, {}]\n", low.x(), low.y(), low.z(),
                           high.x(), high.y(), high.z());
    }
  const Vec3 off(1.3, -0.9, 0);
  const Probing web(s, block,
                    to(s, middle + off + Vec3(0, 0, 5)) + "o<probe_web> call " + words(s, {wx, wy, 10, 4}) +
                        "[0]\n" + results);
  const Probing pocket(
      s, walls,
      to(s, middle + off - Vec3(0, 0, 5)) + "o<probe_pocket> call " + words(s, {wx, wy}) + "[0]\n" + results);
  for (const Probing* run : {&web, &pocket}) {
    expect_done(*run);
    EXPECT_NEAR(run->mm(101), middle.x(), kStep / 2 + kRounding);
    EXPECT_NEAR(run->mm(102), middle.y(), kStep / 2 + kRounding);
    const double side = run == &web ? -kStep : kStep;  // deep in the web is narrow, in the pocket wide
    EXPECT_NEAR(run->mm(103), wx + side, kStep + kRounding);
    EXPECT_NEAR(run->mm(104), wy + side, kStep + kRounding);
    const std::string name = run == &web ? "web" : "pocket";
    Worst::note(name + ", middle, um", 1000 * (run->mm(101) - middle.x()));
    Worst::note(name + ", width, um", 1000 * (run->mm(103) - wx));
  }
}

// The work offset as the routines leave it: angle, then corner and height. Then the part's own corner is zero
// and its edges are the axes.
TEST_P(ProbingAt, OffsetsAreSet) {
  Lots lots(400 + GetParam());
  const WorkOffset s = lots.work_offset();
  const double turn = lots.between(-10, 10);
  const Vec3 corner(lots.between(-20, 20), lots.between(-20, 20), -20);
  const std::string part =
      "[[io.plate]]\n" + s.frame(corner, turn) + "min_mm = [0, 0, -30]\nmax_mm = [50, 60, 0]\n";
  const std::string calls =
      to(s, corner + Vec3(12, 12, 8)) + "o<probe_height> call " + words(s, {8}) + "[1] " + words(s, {2.5}) +
      "\n" + fmt::format("#101 = [#5422 - {}]\n", 10.5 / s.unit_mm()) +
      to(s, Vec3(corner.x() + 12, corner.y() - 9, -5), 30) + "o<probe_angle> call [1] " + words(s, {9, 25}) +
      "[1]\n" + "o<probe_edge> call [1] " + words(s, {9}) + "[0]\n" + "#102 = #<_probe_y>\nG91 G0 X" +
      fmt::format("{:.9f}", 15 / s.unit_mm()) + "\nG90\no<probe_edge> call [1] " + words(s, {9}) + "[1] " +
      words(s, {-4}) + "\n#103 = #<_probe_y>\n#104 = #5230\no<probe_edge> call [1] " + words(s, {9}) +
      "[0]\n#105 = #<_probe_y>\n";
  const Probing run(s, part, calls);
  expect_done(run);
  EXPECT_NEAR(run.mm(101), 0, kStep + kRounding) << "8 above a face that is called 2.5";
  EXPECT_NEAR(run.parameters[104], s.rotation_deg + turn, kStep / 25 * kDegPerRad * 1.05);
  Worst::note("angle at 25 mm, deg", run.parameters[104] - s.rotation_deg - turn);
  EXPECT_NEAR(run.mm(103), run.mm(102), kStep * (1 + 15.0 / 25) + kRounding) << "the edge runs along X";
  EXPECT_NEAR(run.mm(105), -4, kStep + kRounding) << "the edge is where it was said to be";
}

TEST(Probing, ACornerBecomesTheOrigin) {
  WorkOffset s;
  s.rotation_deg = 25;
  s.origin = Vec3(5, -7, 0);
  const Vec3 corner(12, 3, -20);
  const Probing run(s,
                    "[[io.plate]]\n" + s.frame(corner, 0) + "min_mm = [-50, 0, -30]\nmax_mm = [0, 60, 0]\n",
                    to(s, corner + Vec3(9, -8, -5)) + "o<probe_corner> call [-7.5] [6.5] [8] [12] [0] [1]\n" +
                        "#101 = [#5420 - 9]\n#102 = [#5421 + 8]\n");
  expect_done(run);
  EXPECT_NEAR(run.mm(101), 0, 2.5 * kStep);
  EXPECT_NEAR(run.mm(102), 0, 2.5 * kStep);
}

TEST_P(ProbingAt, ToolSetter) {
  Lots lots(500 + GetParam());
  WorkOffset s = lots.work_offset();
  const double height = lots.between(-90, -70);
  WorkOffset machine;  // the setter lies in machine coordinates
  const std::string setter =
      "[[io.plate]]\n" + machine.frame({60, 30, height}, 0) + "min_mm = [-6, -6, -20]\nmax_mm = [6, 6, 0]\n";
  // Tool 1 is 40 mm long; the table says so too late: 35 before the routine.
  const double above = height + 40 + 12;  // of the nose
  const std::string calls = "G10 L1 P1 Z" + fmt::format("{:.9f}", 35 / s.unit_mm()) + "\nG43\nG53 G0 X" +
                            fmt::format("{:.9f} Y{:.9f}\nG53 G0 Z{:.9f}\n", 60 / s.unit_mm(),
                                        30 / s.unit_mm(), above / s.unit_mm()) +
                            "o<probe_setter> call " + words(s, {12, height}) +
                            "[1]\n#101 = #<_probe_length>\n#102 = #5403\n#103 = #<_abs_z>\n#104 = #<_z>\n";
  const Probing run(s, setter, calls);
  expect_done(run);
  EXPECT_LE(run.mm(101), 40 + kRounding);
  EXPECT_GE(run.mm(101), 40 - kStep - kRounding);
  Worst::note("tool setter, um", 1000 * (run.mm(101) - 40));
  EXPECT_NEAR(run.parameters[102] - run.mm(101), 0, kRounding) << "lengths of the table are mm";
}

// The tool is really 40 mm long; the table says otherwise, as behind a break.
TEST_P(ProbingAt, BreakCheck) {
  Lots lots(700 + GetParam());
  WorkOffset s = lots.work_offset();
  const double height = lots.between(-90, -70);
  WorkOffset machine;
  const std::string setter =
      "[[io.plate]]\n" + machine.frame({60, 30, height}, 0) + "min_mm = [-6, -6, -20]\nmax_mm = [6, 6, 0]\n";
  const auto check = [&](double table_mm, int goes_on) {
    const double unit = s.unit_mm();
    return fmt::format("G10 L1 P1 Z{:.9f}\nG43\nG53 G0 X{:.9f} Y{:.9f}\nG53 G0 Z{:.9f}\n", table_mm / unit,
                       60 / unit, 30 / unit, (height + 40 + 12) / unit) +
           "#<_probe_overtravel> = " + fmt::format("{:.9f}", 5 / unit) + "\no<probe_break> call " +
           words(s, {12, height, 0.1}) + fmt::format("[{}]\n", goes_on);
  };
  const std::string keep = "#{0} = #<_probe_broken>\n#{1} = #<_probe_shorter>\n";
  const Probing run(s, setter,
                    check(40, 0) + fmt::format(fmt::runtime(keep), 101, 102) + check(40.05, 0) +
                        fmt::format(fmt::runtime(keep), 103, 104) + check(40.5, 1) +
                        fmt::format(fmt::runtime(keep), 105, 106) + check(38, 1) +
                        fmt::format(fmt::runtime(keep), 107, 108));
  expect_done(run);
  EXPECT_EQ(run.parameters[101], 0);
  EXPECT_EQ(run.parameters[103], 0) << "shorter by less than the tolerance";
  EXPECT_EQ(run.parameters[105], 1);
  EXPECT_EQ(run.parameters[107], 1) << "a longer tool is another one";
  const double shorter[] = {0, 0.05, 0.5, -2};
  for (int i = 0; i < 4; ++i) {
    EXPECT_GE(run.mm(102 + 2 * i), shorter[i] - kRounding);
    EXPECT_LE(run.mm(102 + 2 * i), shorter[i] + kStep + kRounding);
  }
  const Probing broken(s, setter, check(40.5, 0));
  EXPECT_NE(broken.error.find("is broken"), std::string::npos) << broken.error;
  // So short that it meets nothing: the setter is 20 mm lower than its height says.
  const Probing gone(s,
                     "[[io.plate]]\n" + machine.frame({60, 30, height - 20}, 0) +
                         "min_mm = [-6, -6, -20]\nmax_mm = [6, 6, 0]\n",
                     check(40, 1) + fmt::format(fmt::runtime(keep), 101, 102));
  expect_done(gone);
  EXPECT_EQ(gone.parameters[101], 1);
  EXPECT_NEAR(gone.mm(102), 5, kRounding);
}

// A face that is tilted: the plane of G68.2 is its own, and the routines measure in it. The tool stands
// square to the plane, the table is turned.
TEST_P(ProbingAt, TiltedPlanes) {
  Lots lots(600 + GetParam());
  WorkOffset s;
  s.origin = Vec3(lots.between(-20, 20), lots.between(-20, 20), lots.between(-20, 20));
  s.inch = GetParam() % 2 == 0;
  const Vec3 corner(lots.between(-20, 20), lots.between(-20, 20), lots.between(-20, 20));
  const double i = lots.between(-90, 90), j = lots.between(10, 60), k = lots.between(-40, 40);
  const Vec3 at = s.origin + corner;
  const double d = lots.between(10, 14);
  const std::string part = fmt::format(
      "[[io.plate]]\nat_mm = [{:.12f}, {:.12f}, {:.12f}]\nturn_deg = [{:.12f}, {:.12f}, {:.12f}]\n"
      "min_mm = [-3, -4, -30]\nmax_mm = [50, 40, -2]\n"
      "[[io.plate.bore]]\nx_mm = 25\ny_mm = 18\ndiameter_mm = {}\n",
      at.x(), at.y(), at.z(), i, j, k, d);
  const Vec3 u = corner / s.unit_mm();
  const std::string calls =
      fmt::format("G0 Z{:.9f}\nG68.2 X{:.12f} Y{:.12f} Z{:.12f} I{:.12f} J{:.12f} K{:.12f}\nG53.1\n",
                  150 / s.unit_mm(), u.x(), u.y(), u.z(), i, j, k) +
      to(s, {5, 5, 6}, 60) + "o<probe_height> call " + words(s, {8}) + "[0]\n#100 = #<_probe_z>\n" +
      to(s, {24.5, 18.5, -9}) + "o<probe_bore> call " + words(s, {d}) +
      "[0]\n#101 = #<_probe_x>\n#102 = #<_probe_y>\n#103 = #<_probe_diameter>\n" + to(s, {-12, -13, -8}) +
      "o<probe_corner> call " + words(s, {7, 8, 8, 12}) +
      "[0] [0]\n#104 = #<_probe_x>\n#105 = #<_probe_y>\n#106 = #<_probe_angle>\nG69\n";
  const Probing run(s, part, calls, "cradle");
  expect_done(run);
  EXPECT_NEAR(run.mm(100), -2 - kStep / 2, kStep / 2 + kRounding);
  EXPECT_NEAR(run.mm(101), 25, kStep / 2 + kRounding);
  EXPECT_NEAR(run.mm(102), 18, kStep / 2 + kRounding);
  EXPECT_NEAR(run.mm(103), d + kStep, kStep + kRounding);
  EXPECT_NEAR(run.mm(104), -3, 2.4 * kStep);
  EXPECT_NEAR(run.mm(105), -4, 2.4 * kStep);
  EXPECT_NEAR(run.parameters[106], 0, kStep / 12 * kDegPerRad * 1.01);
  Worst::note("tilted plane, bore, um", 1000 * std::hypot(run.mm(101) - 25, run.mm(102) - 18));
}

// Fifty edges with 1 um of noise: scatter as that of one touch, and no bias but half a step.
TEST(Probing, NoiseOfTheProbeIsNoiseOfTheResult) {
  constexpr int kTouches = 50;
  constexpr double kNoise = 0.001;
  const WorkOffset s;
  std::string calls = to(s, {0, 0, -30});
  for (int k = 0; k < kTouches; ++k)
    calls += fmt::format("o<probe_edge> call [0] [8] [0]\n#{} = #<_probe_x>\n", 101 + k);
  const Probing run(
      s,
      fmt::format("noise_mm = {}\nseed = 3\n[[io.plate]]\nmin_mm = [10, -20, -60]\nmax_mm = [40, 20, "
                  "-20]\n",
                  kNoise),
      calls);
  expect_done(run);
  double sum = 0, squares = 0;
  for (int k = 0; k < kTouches; ++k) sum += run.mm(101 + k) - 10;
  for (int k = 0; k < kTouches; ++k) squares += std::pow(run.mm(101 + k) - 10 - sum / kTouches, 2);
  const double scatter = std::sqrt(squares / (kTouches - 1));
  EXPECT_NEAR(scatter, kNoise, 3 * kNoise / std::sqrt(2.0 * kTouches));
  EXPECT_NEAR(sum / kTouches, kStep / 2, 3 * kNoise / std::sqrt(kTouches));
}

constexpr char kWall[] = "[[io.plate]]\nmin_mm = [10, -20, -60]\nmax_mm = [40, 20, -20]\n";

TEST(Probing, AProbeThatMeetsNothingEndsWithTheFaultOfItsMove) {
  const WorkOffset s;
  const Probing run(s, kWall, to(s, {-20, 0, -30}) + "o<probe_edge> call [0] [10] [0]\n#101 = 1\n");
  EXPECT_EQ(run.result.fault, Fault::kProbe);
  EXPECT_EQ(run.parameters[101], 0) << "nothing after it is carried out";
  const Probing further(
      s, kWall,
      to(s, {-20, 0, -30}) +
          "#<_probe_overtravel> = 25\no<probe_edge> call [0] [10] [0]\n#101 = #<_probe_x>\n");
  expect_done(further);
  EXPECT_NEAR(further.mm(101), 10, kStep + kRounding);
}

TEST(Probing, SomethingInTheWayEndsTheProgram) {
  const WorkOffset s;
  const Probing run(s, std::string(kWall) + "[[io.plate]]\nmin_mm = [-9, -50, -60]\nmax_mm = [0, -20, -10]\n",
                    to(s, {2, 0, -30}) + "o<probe_angle> call [0] [6.5] [-15]\n#101 = 1\n" +
                        "G0 X-8\no<probe_angle> call [0] [16.5] [-20]\n#102 = 1\n");
  EXPECT_EQ(run.parameters[101], 1);
  EXPECT_EQ(run.parameters[102], 0);
  EXPECT_NE(run.error.find("has met something on its way"), std::string::npos) << run.error;
}

TEST(Probing, OnlyTheOffsetInForceIsSet) {
  const WorkOffset s;
  const Probing run(s, kWall, to(s, {0, 0, -30}) + "o<probe_edge> call [0] [8] [2]\n");
  EXPECT_NE(run.error.find("P must be the work offset in force"), std::string::npos) << run.error;
}

// The modes of the caller come back, and a line says what was found.
TEST(Probing, TheCallerFindsItsModesAgain) {
  const WorkOffset s;
  const Probing run(s, kWall,
                    to(s, {0, 0, -30}) +
                        "G91 F1234 G64 P0.5\no<probe_edge> call [0] [8] [0]\n#101 = #<_incremental>\n#102 = "
                        "#<_feed>\n");
  expect_done(run);
  EXPECT_EQ(run.parameters[101], 1);
  EXPECT_EQ(run.parameters[102], 1234);
  ASSERT_EQ(run.said.size(), 1u);
  EXPECT_EQ(run.said[0].substr(0, 13), "edge at X10.0");
}

}  // namespace
}  // namespace trn

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "app/session/assembly.h"
#include "core/frames.h"
#include "core/ports.h"
#include "tests/app/session/machine_run.h"

// G183 through the whole kernel, measured on the simulated tool in the work, beside the same hole without the
// cycle (docs/sources.md S3.4). A hole is measured on the samples whose tip is inside the work.
namespace trn::test {
namespace {

struct Hole {
  Vec3 mouth_W;
  double tilt_deg, depth;  ///< tilt about X
  int pecks;
  Vec3 axis_W() const { return {0, -std::sin(rad_from_deg(tilt_deg)), std::cos(rad_from_deg(tilt_deg))}; }
};

struct Measured {
  double off_line_mm = 0;   ///< worst distance of the tip from the hole's axis
  double axis_rad = 0;      ///< worst angle of the tool to it
  double bottom_mm = 1e9;   ///< along the axis
  std::vector<double> low;  ///< where the feed turned round
};

Measured measure(const MachineRun& run, const Hole& hole, std::uint32_t line) {
  Measured out;
  double before = 0, last = 0;
  for (const Sample& s : run.samples) {
    if (s.line != line) continue;
    const Vec3 from_mouth = s.p_W - hole.mouth_W;
    const double along = from_mouth.dot(hole.axis_W());
    if (last < before && along > last && last < 0) out.low.push_back(last);
    if (along != last) before = last;
    last = along;
    if (along > 0) continue;
    out.bottom_mm = std::min(out.bottom_mm, along);
    out.off_line_mm = std::max(out.off_line_mm, (from_mouth - along * hole.axis_W()).norm());
    out.axis_rad = std::max(out.axis_rad, s.u_W.cross(hole.axis_W()).norm());
  }
  return out;
}

/// Rotary words of the machine that tilt the tool by tilt_deg about X of the work.
std::string tilt_words(const std::string& config, const Hole& hole) {
  const Assembly assembly = assemble(config);
  Vec3 abc;
  EXPECT_EQ(assembly.kinematics->words_for_axis(hole.axis_W(), Vec3::Zero(), abc), KinStatus::kOk);
  std::string out;
  for (int i = 0; i < 3; ++i)
    if (assembly.kinematics->word_mask() >> (kA + i) & 1)
      out += fmt::format(" {}{:.15f}", "ABC"[i], deg_from_rad(abc[i]));
  return out;
}

struct Case {
  const char* machine;
  double zero_mm;  ///< height of program zero where the machine reaches well
};

class Drilling : public testing::TestWithParam<Case> {
 protected:
  std::string machine_ = GetParam().machine;
  std::string head(const char* mode) const {
    return fmt::format(
        "G21 G17 G40 G49 G80 G90 G94 {}\nG10 L2 P1 X0 Y0 Z{}\nG54\nT1 M6\nG43 H1\nG0 X0 Y0 Z60\n", mode,
        GetParam().zero_mm);
  }
  MachineRun drill(const Hole& hole, const char* mode) const {
    return run_text(config_of(machine_),
                    head(mode) + fmt::format("F900 G183 X{} Y{} Z{}{} H-{} Q{} R2\nG80\nM2\n",
                                             hole.mouth_W.x(), hole.mouth_W.y(), hole.mouth_W.z(),
                                             tilt_words(config_of(machine_), hole), hole.depth, hole.pecks));
  }
  void expect_hole(const Hole& hole, const char* mode) const {
    const MachineRun run = drill(hole, mode);
    expect_true_tips(machine_, run, 50);
    const Measured m = measure(run, hole, 7);
    EXPECT_LT(m.off_line_mm, 1e-6);  // entry point and straightness
    EXPECT_LT(m.axis_rad, 1e-6);
    EXPECT_NEAR(m.bottom_mm, -hole.depth, 1e-9);
    ASSERT_EQ(static_cast<int>(m.low.size()), hole.pecks);
    for (int i = 0; i < hole.pecks; ++i)
      EXPECT_NEAR(m.low[static_cast<std::size_t>(i)], -hole.depth * (i + 1) / hole.pecks, 1e-9);
    RecordProperty("off_line_mm", fmt::format("{:.2g}", m.off_line_mm));
    RecordProperty("axis_rad", fmt::format("{:.2g}", m.axis_rad));
  }
};

TEST_P(Drilling, FirstHoleOfThePaper) { expect_hole({Vec3(35, 60, 10), 4, 40, 4}, "G61"); }
TEST_P(Drilling, SecondHoleOfThePaper) { expect_hole({Vec3(-50, 0, 10), 6, 60, 3}, "G64 P0.01"); }

INSTANTIATE_TEST_SUITE_P(Machines, Drilling,
                         testing::Values(Case{"cradle", 0}, Case{"head", 0}, Case{"head_table", 0},
                                         Case{"hexapod", 20}, Case{"rail_mill", -330}, Case{"nutating", 0},
                                         Case{"hexapod_mirror", 480}),
                         [](const auto& each) { return std::string(each.param.machine); });

/// The hole without the cycle: RTCP off, the same words on the machine's own axes. Returns where the intended
/// mouth lies, seen from the tip, in the tool's frame, as the tip passes the mouth's height.
Vec3 displaced(const std::string& config, const std::string& words, std::uint32_t line, const Vec3& mouth_B,
               const Mat3& R_WT) {
  const MachineRun run = run_text(config, "G21 G90 G94 G61\nT1 M6\nG43 H1\n" + words + "\nM2\n");
  for (auto s = run.samples.rbegin(); s != run.samples.rend(); ++s)
    if (s->line == line) return R_WT.transpose() * (mouth_B - s->p_B);
  ADD_FAILURE() << "no sample of line " << line;
  return Vec3::Zero();
}

TEST(DrillingWithoutTheCycle, IsDisplacedAsTheChainSays) {
  // hexapod: the table turns by -4 deg about its centre; w from there to the hole: (R - I) w
  const Vec3 w(35, 60, 30);
  const Mat3 R = rot_x(rad_from_deg(4));
  const Vec3 on_hexapod = displaced(config_of("hexapod"), "G0 X0 Y0 Z60\nG0 X35 Y60 Z30 A4 B0", 5, w, R);
  EXPECT_LT((on_hexapod - (R.transpose() * w - w)).norm(), 1e-9);
  // cradle: turns by A about the machine zero, 75 mm above the table's own
  const Vec3 on_cradle =
      displaced(config_of("cradle"), "G0 X0 Y0 Z60\nG0 X35 Y60 Z30 A-4 C0", 5, w + Vec3(0, 0, 75), R);
  EXPECT_LT((on_cradle - (R.transpose() * w - w)).norm(), 1e-9);
  // head: the tip swings about the pivot, L = 50 above it; w = (0, 0, -L) from pivot to tip
  const Vec3 on_head = displaced(config_of("head"), "G0 X0 Y0 Z60\nG0 X35 Y60 Z30 A4 C0", 5, w, R);
  const Vec3 lever(0, 0, -50);
  EXPECT_LT((R * on_head - (lever - R * lever)).norm(), 1e-9);
}

TEST(DrillingWithoutTheCycle, TheHoleItselfIsStraightAndDeepButElsewhere) {
  const std::string config = config_of("hexapod");
  const MachineRun run = run_text(
      config, "G21 G90 G94 G61\nT1 M6\nG43 H1\nG0 X0 Y0 Z60\nG0 X35 Y60 Z30 A4 B0\nG1 Z-10 F900\nM2\n");
  const Mat3 R_WT = rot_x(rad_from_deg(4));
  const Vec3 mouth = R_WT * Vec3(35, 60, 30);  // where the tip stands on the table: R w
  double worst = 0, bottom = 0;
  for (const Sample& s : run.samples) {
    if (s.line != 6) continue;
    const double along = (s.p_B - mouth).dot(R_WT.col(2));
    worst = std::max(worst, (s.p_B - mouth - along * R_WT.col(2)).norm());
    bottom = std::min(bottom, along);
  }
  EXPECT_LT(worst, 1e-9);
  EXPECT_NEAR(bottom, -40, 1e-9);
}

// docs/sources.md S3.5: w = (35, 60, -606.08), 4 deg about X, stand-off 15.81 give (0, 42.132, 21.47). A
// table whose turning centre lies 606.08 mm above the hole: the shipped hexapod with its platform joints 700
// mm below the platform's origin.
TEST(DrillingWithoutTheCycle, GivesThePapersDisplacement) {
  std::string text = text_of(config_of("hexapod"));
  for (std::size_t at = 0; (at = text.find("platform_mm = [", at)) != std::string::npos; ++at) {
    const std::size_t end = text.find(", 0.0]", at);
    text.replace(end, 6, ", -700.0]");
  }
  const std::size_t home = text.find("home_mm = [0.0, 0.0, 640.0]");
  ASSERT_NE(home, std::string::npos);
  text.replace(home, 27, "home_mm = [0.0, 0.0, 1340.0]");
  const std::string config = written("hanging_hexapod.toml", text);
  const Vec3 w(35, 60, -606.08);
  const Mat3 R_WT = rot_x(rad_from_deg(-4));  // the table turns by +4 deg
  const Vec3 seen =
      displaced(config, fmt::format("G0 X0 Y0 Z-621.89\nG0 X35 Y60 Z{} A-4 B0", -606.08 - 15.81), 5, w, R_WT);
  EXPECT_NEAR(seen.x(), 0, 1e-9);
  EXPECT_NEAR(seen.y(), 42.132, 5e-4);
  EXPECT_NEAR(seen.z(), 21.47, 5e-3);
}

}  // namespace
}  // namespace trn::test

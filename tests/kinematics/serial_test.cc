#include <fmt/format.h>
#include <gtest/gtest.h>

#include <kdl/chainfksolverpos_recursive.hpp>

#include "core/axes.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/ports.h"
#include "kinematics/serial/serial_kinematics.h"
#include "tests/kinematics/kdl_chain.h"
#include "tests/kinematics/machines.h"
#include "tests/kinematics/sampling.h"
#include "tests/support/rounds.h"

namespace trn {
namespace {

std::string joint_text(const std::string& name, bool rotary, double turn_deg) {
  return fmt::format(
      fmt::runtime(
          rotary ? "[[joint]]\nname=\"{0}\"\ntype=\"rotary\"\nmin_deg=-{1}\nmax_deg={1}\nvelocity_deg_s=9\n"
                   "acceleration_deg_s2=9\njerk_deg_s3=9\n"
                 : "[[joint]]\nname=\"{0}\"\ntype=\"linear\"\nmin_mm=-300\nmax_mm=300\nvelocity_mm_s=9\n"
                   "acceleration_mm_s2=9\njerk_mm_s3=9\n"),
      name, turn_deg);
}

/// Rotary joints turn so far to both sides.
LoadedMachine machine_of(const std::string& joints, const std::string& branches, double turn_deg = 170) {
  std::string text = "[machine]\nname=\"m\"\nperiod_s=0.001\n";
  for (const char name : joints) text += joint_text(std::string(1, name), name < 'X', turn_deg);
  text += "[kinematics]\ntype=\"serial\"\n" + branches;
  Machine machine = read_machine(parse_config(text, "m.toml"));
  auto kinematics = make_kinematics(machine);
  return {std::move(machine), std::move(kinematics)};
}

std::string tool(char joint, const std::string& direction, const std::string& offset = "0,0,0") {
  return fmt::format("[[kinematics.tool_branch]]\njoint=\"{}\"\ndirection=[{}]\noffset_mm=[{}]\n", joint,
                     direction, offset);
}
std::string work(char joint, const std::string& direction, const std::string& offset = "0,0,0") {
  return fmt::format("[[kinematics.work_branch]]\njoint=\"{}\"\ndirection=[{}]\noffset_mm=[{}]\n", joint,
                     direction, offset);
}
std::string tool_xyz() { return tool('X', "1,0,0") + tool('Y', "0,1,0") + tool('Z', "0,0,1"); }

/// Forward against KDL, and inverse judged by KDL's forward, from near and from far seeds.
void judge_by_kdl(const LoadedMachine& loaded, bool closed_form, int count) {
  const Kinematics& kin = *loaded.kinematics;
  EXPECT_EQ(dynamic_cast<const SerialKinematics&>(kin).closed_form(), closed_form);
  const KdlChain kdl = make_kdl_chain(loaded.machine);
  KDL::ChainFkSolverPos_recursive judge(kdl.chain);
  const auto judged = [&](const JointVec& q) {
    KDL::Frame frame;
    judge.JntToCart(kdl.joints(q), frame);
    return Pose{Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(frame.M.data),
                Vec3(frame.p.x(), frame.p.y(), frame.p.z())};
  };
  Sampler sampler(loaded, 11);
  int solved = 0;
  for (int round = 0; round < count && !testing::Test::HasFailure(); ++round) {
    const JointVec q = sampler.joints();
    const Pose truth = judged(q);
    Pose X;
    ASSERT_EQ(kin.forward(q, X), KinStatus::kOk);
    EXPECT_LT((X.p - truth.p).norm(), 1e-9);
    EXPECT_LT((X.R - truth.R).norm(), 1e-12);
    JointVec back;
    const KinStatus status = kin.inverse(truth, round % 2 ? sampler.near(q) : sampler.joints(), back);
    if (status == KinStatus::kOk) {
      const Pose reached = judged(back);
      EXPECT_LT((reached.p - truth.p).norm(), 2e-9) << q.transpose();
      EXPECT_LT((reached.R.col(2) - truth.R.col(2)).norm(), 2e-12) << q.transpose();
      ++solved;
    }
  }
  EXPECT_GE(solved, closed_form ? count : count * 9 / 10);
}

TEST(Serial, ShippedConfigsAgreeWithKdl) {
  for (const char* name : {"cradle", "head", "head_table", "mill", "micro_stage", "nutating", "angle_head"}) {
    SCOPED_TRACE(name);
    judge_by_kdl(load_machine(name), true, std::string(name) == "mill" ? 500 : test::rounds(3000));
  }
}

TEST(Serial, NutatingAxesAgreeWithKdl) {
  judge_by_kdl(machine_of("XYZBC", tool_xyz() + work('B', "0,1,1", "3,-4,5") + work('C', "0,0,1", "1,2,-60")),
               true, test::rounds(3000));
  judge_by_kdl(machine_of("XYZAC", tool_xyz() + tool('C', "0,0,1") + tool('A', "1,0,1", "7,0,-90")), true,
               test::rounds(3000));
}

TEST(Serial, ObliqueAxesAgreeWithKdl) {
  const std::string linear = tool('X', "1,0.1,0") + tool('Y', "0,1,0") + tool('Z', "0.1,0.5,1");
  judge_by_kdl(
      machine_of("XYZAC", linear + work('A', "1,0.05,-0.02", "0,3,0") + work('C', "0.1,0,1", "0,0,-75")),
      true, test::rounds(3000));
  judge_by_kdl(machine_of("XYZA", tool_xyz() + work('A', "1,0,0", "0,10,20")), true, test::rounds(3000));
}

std::string tilt(const std::string& direction, double tilt_deg, const std::string& offset = "0,0,0") {
  return fmt::format("[[kinematics.tool_branch]]\ndirection=[{}]\ntilt_deg={}\noffset_mm=[{}]\n", direction,
                     tilt_deg, offset);
}
std::string nose(const std::string& offset) {
  return fmt::format("[[kinematics.tool_branch]]\noffset_mm=[{}]\n", offset);
}

TEST(Serial, TiltedHeadsAgreeWithKdl) {
  // angle heads on a mill; one that is turned by hand about two axes; a rotary axis behind the tilt, before
  // it, and in the table; three axes that only Newton solves
  judge_by_kdl(machine_of("XYZ", tool_xyz() + tilt("1,0,0", 45, "0,0,-90") + nose("0,0,-60")), true, 500);
  judge_by_kdl(
      machine_of("XYZ", tool_xyz() + tilt("0,0,1", 30) + tilt("0,1,0", -90, "5,0,-90") + nose("0,3,-60")),
      true, 500);
  judge_by_kdl(machine_of("XYZB", tool_xyz() + tilt("0,1,1", 25, "0,0,-90") + tool('B', "0,1,0", "1,2,-70")),
               true, test::rounds(3000));
  judge_by_kdl(
      machine_of("XYZC", tool_xyz() + tool('C', "0,0,1") + tilt("1,0,0", 90, "0,20,-90") + nose("0,0,-40")),
      true, test::rounds(3000));
  judge_by_kdl(machine_of("XYZAC", tool_xyz() + tilt("0,1,0", 20, "0,0,-50") + work('A', "1,0,0", "0,10,20") +
                                       work('C', "0,0,1", "0,0,-75")),
               true, test::rounds(3000));
  judge_by_kdl(machine_of("XYZABC", tool_xyz() + tool('C', "0,0,1") + tilt("1,0,0", 10, "0,0,-20") +
                                        tool('A', "1,0,0", "0,0,-50") + tool('B', "0,1,0", "0,0,-80")),
               false, 500);
}

// What the config promises: an axis that is clamped at 35 degrees, and the same axis with a joint that stands
// there.
TEST(Serial, ATiltIsAnAxisThatIsClamped) {
  const std::string before = tool_xyz() + tool('C', "0,0,1", "0,0,-30"), behind = nose("4,0,-60");
  const LoadedMachine clamped = machine_of("XYZC", before + tilt("1,0.5,0", 35, "7,0,-90") + behind);
  const LoadedMachine free = machine_of("XYZCA", before + tool('A', "1,0.5,0", "7,0,-90") + behind);
  Sampler sampler(clamped, 12);
  for (int round = 0; round < 500; ++round) {
    const JointVec q = sampler.joints();
    JointVec q_free(5);
    q_free << q, rad_from_deg(35);
    Pose X, X_free;
    ASSERT_EQ(clamped.kinematics->forward(q, X), KinStatus::kOk);
    ASSERT_EQ(free.kinematics->forward(q_free, X_free), KinStatus::kOk);
    EXPECT_LT((X.p - X_free.p).norm(), 1e-12 * 1000);
    EXPECT_LT((X.R - X_free.R).norm(), 1e-14);
  }
}

TEST(Serial, TheOrderOfTheJointsIsFree) {
  const std::string branches = tool_xyz() + tool('C', "0,0,1") + tool('A', "1,0,0", "0,0,-50");
  for (const char* order : {"XYZCA", "AXYZC", "CAXYZ"}) {
    SCOPED_TRACE(order);
    const LoadedMachine loaded = machine_of(order, branches);
    judge_by_kdl(loaded, true, 200);
    const Mat3 R = loaded.kinematics->orientation({0.3, 0, 0.8});
    EXPECT_LT((R - rot_z(0.8) * rot_x(0.3)).norm(), 1e-14);
    Vec3 abc;
    ASSERT_EQ(loaded.kinematics->words_for_axis(R.col(2), {0.2, 0, 0.7}, abc), KinStatus::kOk);
    EXPECT_LT((abc - Vec3(0.3, 0, 0.8)).norm(), 1e-12);
  }
}

TEST(Serial, OtherChainsAreSolvedByNewton) {
  // three rotary axes; and a rotary axis in place of a linear one
  judge_by_kdl(machine_of("XYZABC", tool_xyz() + tool('C', "0,0,1") + tool('A', "1,0,0", "0,0,-50") +
                                        tool('B', "0,1,0", "0,0,-80")),
               false, 500);
  judge_by_kdl(machine_of("XZABC", tool('X', "1,0,0") + tool('Z', "0,0,1") + work('C', "0,0,1", "0,300,0") +
                                       tool('B', "0,1,0", "0,0,-50") + tool('A', "1,0,0", "0,0,-80")),
               false, 500);
}

// With RTCP the rotary words are orders, also where the pose would leave a choice: two axes in one direction,
// three axes, too few linear joints for every place. What the linear joints cannot reach is refused.
TEST(Serial, AtTheTipTheRotaryJointsStandAsTold) {
  const std::string lathe = tool('Z', "0,0,1") + tool('X', "1,0,0") + work('C', "0,0,1");
  const std::string lathe_b =
      tool('Z', "0,0,1") + tool('X', "1,0,0") + tool('B', "0,1,0", "0,0,-80") + work('C', "0,0,1");
  const std::string twice = tool_xyz() + tool('B', "0,1,0", "0,0,-60") + work('C', "0,1,0");
  const std::string three =
      tool_xyz() + tool('C', "0,0,1") + tool('A', "1,0,0", "0,0,-50") + tool('B', "0,1,0", "0,0,-80");
  const std::string scara =
      work('A', "0,0,1") + tool('Z', "0,0,1") + tool('C', "0,0,1", "200,0,0") + tool('B', "0,0,1", "150,0,0");
  int refused = 0;
  for (const auto& [joints, branches] :
       {std::pair{"XZC", lathe}, {"XZBC", lathe_b}, {"XYZBC", twice}, {"XYZABC", three}, {"ZABC", scara}}) {
    SCOPED_TRACE(joints);
    const LoadedMachine loaded = machine_of(joints, branches);
    const Kinematics& kin = *loaded.kinematics;
    Sampler sampler(loaded, 31);
    for (int round = 0; round < 200; ++round) {
      const JointVec q = sampler.joints();
      Words words;
      Pose X, found;
      ASSERT_EQ(kin.words_from_joints(q, words), KinStatus::kOk);
      ASSERT_EQ(kin.forward(q, X), KinStatus::kOk);
      const Vec3 tool(1, -2, 70), tip = X * Vec3(-tool);
      JointVec back;
      ASSERT_EQ(kin.joints_at_tip(words.tail<3>(), tip, tool, sampler.joints(), found, back), KinStatus::kOk);
      EXPECT_LT((back - q).norm(), 1e-7);
      for (std::size_t i = 0; i < loaded.machine.joints.size(); ++i) {
        const auto k = static_cast<Eigen::Index>(i);
        if (loaded.machine.joints[i].kind == JointKind::kRotary) {
          EXPECT_EQ(back[k], q[k]) << i;
        }
      }
      // A place a millimetre beside, across all linear joints: there is one where they are fewer than three.
      Vec3 span[3] = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
      int linear = 0;
      for (std::size_t i = 0; i < loaded.machine.joints.size(); ++i) {
        if (loaded.machine.joints[i].kind == JointKind::kRotary) continue;
        JointVec beside = q;
        beside[static_cast<Eigen::Index>(i)] += 1;
        Pose X_beside;
        ASSERT_EQ(kin.forward(beside, X_beside), KinStatus::kOk);
        span[linear++] = X_beside.p - X.p;
      }
      if (linear == 3) continue;
      const Vec3 across = linear == 2 ? span[0].cross(span[1]) : span[0].unitOrthogonal();
      EXPECT_EQ(kin.joints_at_tip(words.tail<3>(), tip + across, tool, q, found, back),
                KinStatus::kUnreachable);
      ++refused;
    }
  }
  EXPECT_EQ(refused, 600);
}

TEST(Serial, ThreeAxisMachineRefusesATilt) {
  const LoadedMachine mill = load_machine("mill");
  JointVec q;
  EXPECT_EQ(mill.kinematics->inverse({rot_x(0.1), Vec3::Zero()}, JointVec::Zero(3), q),
            KinStatus::kUnreachable);
  EXPECT_EQ(mill.kinematics->inverse({Mat3::Identity(), Vec3(1, 2, 3)}, JointVec::Zero(3), q),
            KinStatus::kOk);
  EXPECT_EQ(q, Vec3(1, -2, 3));  // the table carries Y: it moves the other way
}

TEST(Serial, WordsForAxisPrefersTheBranchInsideTheLimits) {
  const LoadedMachine cradle = load_machine("cradle");
  Vec3 abc;
  // From A = 118 deg the nearest way is A = 121 deg, beyond the limit: the table turns round to A = -121?
  // also beyond. At A = 119.9 deg all is well.
  const auto solve = [&](double a_deg) {
    const Vec3 u = cradle.kinematics->orientation({rad_from_deg(a_deg), 0, 0}).col(2);
    EXPECT_EQ(cradle.kinematics->words_for_axis(u, {rad_from_deg(118), 0, 0}, abc), KinStatus::kOk);
    return deg_from_rad(abc[0]);
  };
  EXPECT_NEAR(solve(119.9), 119.9, 1e-9);
  EXPECT_NEAR(solve(121), 121, 1e-9);
  const LoadedMachine narrow = machine_of("XYZAC", tool_xyz() + work('A', "1,0,0") + work('C', "0,0,1"));
  const Vec3 u = narrow.kinematics->orientation({0.5, rad_from_deg(0), rad_from_deg(175)}).col(2);
  ASSERT_EQ(narrow.kinematics->words_for_axis(u, {0.4, 0, rad_from_deg(169)}, abc), KinStatus::kOk);
  EXPECT_NEAR(abc[0], -0.5, 1e-12);  // C stops at 170 deg, so the other tilt and C - 180 deg
  EXPECT_NEAR(deg_from_rad(abc[2]), -5, 1e-9);
}

TEST(Serial, ASingleRotaryJointMayBeTheFirstOfAll) {
  for (const char* order : {"AXYZ", "XAYZ", "XYZA"}) {
    const LoadedMachine loaded = machine_of(order, tool_xyz() + work('A', "1,0,0"));
    const Vec3 u = loaded.kinematics->orientation({0.4, 0, 0}).col(2);
    Vec3 abc;
    ASSERT_EQ(loaded.kinematics->words_for_axis(u, {0.3, 0, 0}, abc), KinStatus::kOk);
    EXPECT_LT((abc - Vec3(0.4, 0, 0)).norm(), 1e-12) << order;
  }
}

// The nearest answer to the seed may lie turns beyond the limits of 360 degrees: as many as are missing are
// taken back, and none more.
TEST(Serial, WordsForAxisComeInsideTheLimitsByWholeTurns) {
  const LoadedMachine loaded = machine_of("XYZA", tool_xyz() + work('A', "1,0,0"), 360);
  const auto a_deg = [&](double wanted_deg, double seed_deg) {
    const Vec3 u = loaded.kinematics->orientation({rad_from_deg(wanted_deg), 0, 0}).col(2);
    Vec3 abc;
    EXPECT_EQ(loaded.kinematics->words_for_axis(u, {rad_from_deg(seed_deg), 0, 0}, abc), KinStatus::kOk);
    return deg_from_rad(abc[0]);
  };
  EXPECT_NEAR(a_deg(10, 180), 10, 1e-9);
  EXPECT_NEAR(a_deg(10, 340), 10, 1e-9) << "370";
  EXPECT_NEAR(a_deg(10, 725), 10, 1e-9) << "730, two turns too far";
  EXPECT_NEAR(a_deg(10, 1085), 10, 1e-9) << "1090";
  EXPECT_NEAR(a_deg(-10, -340), -10, 1e-9) << "-370";
  EXPECT_NEAR(a_deg(10, -725), -350, 1e-9) << "-710";
  EXPECT_NEAR(a_deg(-10, -1085), -10, 1e-9) << "-1090";
  EXPECT_NEAR(a_deg(200, 350), 200, 1e-9) << "inside: left where it is";
}

// Programmed A and C through the pole: joints move without a jump, and the third differences are those of a
// smooth curve, free of the noise of an arc tangent.
TEST(Serial, SweepsThroughThePoleAreSmooth) {
  for (const char* name : {"cradle", "head", "head_table"}) {
    SCOPED_TRACE(name);
    const LoadedMachine loaded = load_machine(name);
    const Kinematics& kin = *loaded.kinematics;
    const double h = 1e-3;
    std::array<JointVec, 4> last;
    for (int i = 0; i <= 1200; ++i) {
      const double s = (i - 600) * h;
      const bool has_b = (kin.word_mask() & (1u << kB)) != 0;
      Words y;
      y << 50, 30, -20, has_b ? 0 : s, has_b ? s : 0, 1.0 + 2 * s;
      JointVec seed, q;
      ASSERT_EQ(kin.joints_from_words(y, seed), KinStatus::kOk);
      const Mat3 R = kin.orientation(y.tail<3>());
      ASSERT_EQ(kin.inverse({R, y.head<3>() + R * Vec3(0, 0, 120)}, seed, q), KinStatus::kOk);
      std::rotate(last.begin(), last.begin() + 1, last.end());
      last[3] = q;
      if (i < 3) continue;
      const JointVec third = last[3] - 3 * last[2] + 3 * last[1] - last[0];
      // levers below 200 mm and 3 rad per unit of s: |q'''| < 200 * 3^3; rounding 8 * 1e-13
      EXPECT_LT(third.lpNorm<Eigen::Infinity>(), 200 * 27 * h * h * h + 2e-12);
    }
  }
}

TEST(Serial, TheAxisAloneIsFollowedThroughThePole) {
  const LoadedMachine cradle = load_machine("cradle");
  Vec3 abc(-0.3, 0, 0.7);
  for (int i = -300; i <= 300; ++i) {
    const Vec3 u = cradle.kinematics->orientation({i * 1e-3, 0, 0.7}).col(2);
    ASSERT_EQ(cradle.kinematics->words_for_axis(u, abc, abc), KinStatus::kOk);
    EXPECT_NEAR(abc[0], i * 1e-3, 1e-12);
    EXPECT_NEAR(abc[2], 0.7, 1e-12);
  }
}

// Three rotary joints leave a choice that no closed form makes. Whatever is chosen, the axis is the one asked
// for.
TEST(Serial, ThreeRotaryJointsPointTheToolWhereItIsAskedTo) {
  const LoadedMachine loaded = machine_of(
      "XYZABC", tool_xyz() + tool('B', "0,1,0") + work('C', "0,0,1") + work('A', "1,0,0", "0,0,-75"));
  const Kinematics& kin = *loaded.kinematics;
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < 500; ++i) {
    const Vec3 u = Vec3(0.9 * unit(rng), 0.9 * unit(rng), 1).normalized();
    const Vec3 seed = 0.5 * Vec3(unit(rng), unit(rng), unit(rng));
    Vec3 abc;
    ASSERT_EQ(kin.words_for_axis(u, seed, abc), KinStatus::kOk) << i;
    EXPECT_LT((kin.orientation(abc).col(2) - u).norm(), 1e-9) << i;
  }
}

}  // namespace
}  // namespace trn

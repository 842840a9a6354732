#include <gtest/gtest.h>

#include <filesystem>

#include "core/axes.h"
#include "core/config.h"
#include "core/frames.h"
#include "core/ports.h"
#include "core/units.h"
#include "kinematics/platform_kinematics.h"
#include "tests/kinematics/machines.h"
#include "tests/kinematics/sampling.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/paths.h"
#include "tests/support/rounds.h"

// What every machine owes, on every config that ships and on those of tests/data/machines.
namespace trn {
namespace {

constexpr double kMm = 1e-9, kRad = 1e-12;

std::vector<std::string> all_machines() {
  std::vector<std::string> names;
  for (const char* folder : {"/configs", "/tests/data/machines"})
    for (const auto& entry : std::filesystem::directory_iterator(source_dir() + folder))
      if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

class EveryMachine : public testing::TestWithParam<std::string> {
 protected:
  bool rotary(Eigen::Index joint) const {
    return loaded_.machine.joints[static_cast<std::size_t>(joint)].kind == JointKind::kRotary;
  }
  bool serial() const { return dynamic_cast<const PlatformKinematics*>(&kin_) == nullptr; }

  /// How much the tool axis moves for one radian of the laziest combination of rotary joints: 0 at a pole.
  double sensitivity(const JointVec& q) const {
    Eigen::Matrix<double, 3, Eigen::Dynamic> J(3, 0);
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      if (!rotary(i)) continue;
      JointVec up = q, down = q;
      up[i] += 1e-5;
      down[i] -= 1e-5;
      Pose X_up, X_down;
      kin_.forward(up, X_up);
      kin_.forward(down, X_down);
      J.conservativeResize(3, J.cols() + 1);
      J.col(J.cols() - 1) = (X_up.R.col(2) - X_down.R.col(2)) / 2e-5;
    }
    return J.cols() == 0 ? 1.0 : Eigen::JacobiSVD<Eigen::MatrixXd>(J).singularValues().tail(1)[0];
  }

  /// A rotary joint is there, and each of them leaves the tool's axis where it is.
  bool turns_the_tool_only(JointVec q) const {
    Pose X, X_turned;
    kin_.forward(q, X);
    int turned = 0;
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      if (!rotary(i)) continue;
      q[i] += 1;
      ++turned;
      kin_.forward(q, X_turned);
      if ((X.R.col(2) - X_turned.R.col(2)).norm() > kRad) return false;
    }
    return turned > 0;
  }

  void expect_pose(const Pose& X, const Pose& wanted) const {
    EXPECT_LT((X.p - wanted.p).norm(), kMm);
    EXPECT_LT((X.R.col(2) - wanted.R.col(2)).norm(), kRad);
    if (controls_turn_) {
      EXPECT_LT((X.R - wanted.R).norm(), kRad);
    }
  }

  /// By the config's tilts, each about an axis that those before it carry.
  Mat3 home_orientation() const {
    Mat3 R = Mat3::Identity();
    for (const ConfigTable& axis : loaded_.machine.root.table("kinematics").tables_if("tool_branch"))
      if (axis.has("tilt_deg"))
        R = R * Eigen::AngleAxisd(rad_from_deg(axis.number("tilt_deg", Range{-180, 180})),
                                  axis.vec3("direction").normalized());
    return R;
  }

  LoadedMachine loaded_ = load_machine(GetParam());
  const Kinematics& kin_ = *loaded_.kinematics;
  const Mat3 R_home_ = home_orientation();
  /// A serial machine's turn about the tool, or that of one that may turn freely, is nobody's wish.
  bool controls_turn_ =
      !serial() &&
      loaded_.machine.root.table("kinematics").number("free_turn_deg_max", 0.0, kNotNegative) == 0.0;
};

TEST_P(EveryMachine, InverseOfForwardGivesTheJointsBack) {
  Sampler sampler(loaded_, 1);
  for (int round = 0, n = test::rounds(20000); round < n && !HasFailure(); ++round) {
    const JointVec q = sampler.joints();
    Pose X;
    ASSERT_EQ(kin_.forward(q, X), KinStatus::kOk) << q.transpose();
    JointVec back;
    ASSERT_EQ(kin_.inverse(X, q, back), KinStatus::kOk) << q.transpose();
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      if (rotary(i)) {
        EXPECT_EQ(back[i], q[i]);  // the seed's own axis: to the bit
      }
      EXPECT_NEAR(back[i], q[i], kMm) << q.transpose();
    }
  }
}

TEST_P(EveryMachine, InverseOfForwardFromANearbySeed) {
  Sampler sampler(loaded_, 2);
  int well_conditioned = 0;
  bool tilts = false;  // false: its rotary axes turn the tool about itself only
  for (int round = 0, n = test::rounds(20000); round < n && !HasFailure(); ++round) {
    const JointVec q = sampler.joints(), seed = sampler.near(q);
    Pose X, again;
    ASSERT_EQ(kin_.forward(q, X), KinStatus::kOk);
    JointVec back;
    ASSERT_EQ(kin_.inverse(X, seed, back), KinStatus::kOk) << q.transpose();
    ASSERT_EQ(kin_.forward(back, again), KinStatus::kOk);
    expect_pose(again, X);
    tilts = tilts || !turns_the_tool_only(q);
    if (sensitivity(q) < 0.05) continue;  // near a pole the joints are free, only the pose counts
    ++well_conditioned;
    for (Eigen::Index i = 0; i < q.size(); ++i)
      EXPECT_NEAR(back[i], q[i], rotary(i) ? kRad : kMm) << q.transpose() << " | " << seed.transpose();
  }
  if (tilts) {
    EXPECT_GT(well_conditioned, test::rounds(20000) / 3);
  }
}

// Half-way in the words is half-way in the joints, or the machine must not say that words are joints.
TEST_P(EveryMachine, WordsAreJointsWhereItSaysSo) {
  Sampler sampler(loaded_, 9);
  double bends = 0;
  for (int round = 0; round < 500 && !HasFailure(); ++round) {
    const JointVec from = sampler.joints(), to = sampler.near(from);
    Words words_from, words_to;
    ASSERT_EQ(kin_.words_from_joints(from, words_from), KinStatus::kOk);
    ASSERT_EQ(kin_.words_from_joints(to, words_to), KinStatus::kOk);
    JointVec middle;
    if (kin_.joints_from_words((words_from + words_to) / 2, middle) != KinStatus::kOk) continue;
    bends = std::max(bends, (middle - (from + to) / 2).cwiseAbs().maxCoeff());
  }
  EXPECT_EQ(kin_.words_are_joints(), bends < kMm) << bends;
  EXPECT_EQ(kin_.words_are_joints(), serial());
}

TEST_P(EveryMachine, ProgrammedRotaryWordsComeBackToTheBit) {
  Sampler sampler(loaded_, 3);
  for (int round = 0; round < 5000 && !HasFailure(); ++round) {
    Words words;
    ASSERT_EQ(kin_.words_from_joints(sampler.joints(), words), KinStatus::kOk);
    JointVec seed, q;
    ASSERT_EQ(kin_.joints_from_words(words, seed), KinStatus::kOk);
    const Vec3 abc = words.tail<3>();
    Vec3 kept;
    EXPECT_EQ(kin_.words_for_axis(kin_.orientation(abc).col(2), abc, kept), KinStatus::kOk);
    EXPECT_EQ(kept, abc);
    if (!serial()) continue;
    ASSERT_EQ(kin_.inverse({kin_.orientation(abc), Vec3(10, 20, 30)}, seed, q), KinStatus::kOk);
    for (Eigen::Index i = 0; i < q.size(); ++i)
      if (rotary(i)) {
        EXPECT_EQ(q[i], seed[i]);
      }
  }
}

TEST_P(EveryMachine, WordsRoundTrip) {
  Sampler sampler(loaded_, 4);
  for (int round = 0; round < 5000 && !HasFailure(); ++round) {
    const JointVec q = sampler.joints();
    Words words, again;
    JointVec back;
    ASSERT_EQ(kin_.words_from_joints(q, words), KinStatus::kOk);
    ASSERT_EQ(kin_.joints_from_words(words, back), KinStatus::kOk);
    ASSERT_EQ(kin_.words_from_joints(back, again), KinStatus::kOk);
    if (serial()) {
      EXPECT_EQ(back, q);
    }
    EXPECT_LT((again - words).head(3).norm(), kMm);
    EXPECT_LT((again - words).tail(3).norm(), kRad);
    EXPECT_LT((back - q).lpNorm<Eigen::Infinity>(), kMm);
    for (int i = 0; i < 6; ++i)
      if ((kin_.word_mask() & (1u << i)) == 0) {
        EXPECT_EQ(words[i], 0.0);
      }
  }
}

TEST_P(EveryMachine, WordsForAnyAxisPointTheToolOrSayUnreachable) {
  Sampler sampler(loaded_, 5);
  for (int round = 0; round < 20000 && !HasFailure(); ++round) {
    Vec3 u = sampler.direction();
    if (round % 4 == 0) u = Vec3(u.x() * std::pow(10.0, -sampler.uniform(0, 15)), 0, u.z()).normalized();
    const Vec3 seed(sampler.uniform(-7, 7), sampler.uniform(-7, 7), sampler.uniform(-7, 7));
    Vec3 abc;
    if (kin_.words_for_axis(u, seed, abc) == KinStatus::kOk) {
      EXPECT_LT((kin_.orientation(abc).col(2) - u).norm(), kRad) << u.transpose();
    }
    EXPECT_TRUE(abc.allFinite());
  }
  Vec3 abc;
  EXPECT_EQ(kin_.words_for_axis(R_home_.col(2), Vec3::Zero(), abc), KinStatus::kOk);
  EXPECT_EQ(abc, Vec3::Zero());
}

// Two pairs of rotary words may point the tool alike. A path goes on in the pair in which it is.
TEST_P(EveryMachine, WordsForAnAxisNearbyGoOnInTheirBranch) {
  constexpr double kApart = 0.05, kBranch = 0.5;  // rad: of the seed, and less than any other pair is away
  Sampler sampler(loaded_, 9);
  int judged = 0, about_tool = 0;  // an axis along the tool points it nowhere
  for (int round = 0; round < 2000 && !HasFailure(); ++round) {
    const JointVec q = sampler.joints();
    if (sensitivity(q) < 1e-9) ++about_tool;
    if (sensitivity(q) < 0.3) continue;
    Words words;
    ASSERT_EQ(kin_.words_from_joints(q, words), KinStatus::kOk);
    const Vec3 wanted = words.tail<3>();
    Vec3 seed = wanted, abc;
    for (int k = 0; k < 3; ++k)
      if (kin_.word_mask() & 1u << (kA + k)) seed[k] += sampler.uniform(-kApart, kApart);
    ASSERT_EQ(kin_.words_for_axis(kin_.orientation(wanted).col(2), seed, abc), KinStatus::kOk);
    EXPECT_LT((abc - wanted).norm(), kBranch) << wanted.transpose() << " from " << seed.transpose();
    ++judged;
  }
  EXPECT_TRUE(judged > 100 || about_tool == 2000) << judged;
}

TEST_P(EveryMachine, HomeWordsAreThePoseTheProgramIsWrittenIn) {
  // With every word at zero the tool is parallel to Z of M, unless its head is tilted, and M is not turned
  // against the table.
  EXPECT_LT((kin_.home_X_BM().R - Mat3::Identity()).norm(), kRad);
  EXPECT_LT((kin_.orientation(Vec3::Zero()) - R_home_).norm(), kRad);
  const Vec3 tool(0, 0, 100);
  EXPECT_LT((kin_.tool_in_words(tool) - R_home_ * tool).norm(), kMm);
}

TEST_P(EveryMachine, JointsAtTheTipAreThoseOfOrientationSpindleAndInverse) {
  Sampler sampler(loaded_, 8);
  for (int round = 0; round < 5000 && !HasFailure(); ++round) {
    JointVec seed = sampler.joints(), q, wanted;
    Words words;
    ASSERT_EQ(kin_.words_from_joints(seed, words), KinStatus::kOk);
    const Vec3 abc = words.tail<3>(),
               tool(sampler.uniform(-5, 5), sampler.uniform(-5, 5), sampler.uniform(0, 200));
    Pose X, X_reached;
    kin_.forward(seed, X);
    const Mat3 R = kin_.orientation(abc);
    const Vec3 p_BT = X.p - R * tool;
    const KinStatus status = kin_.inverse({R, p_BT + R * tool}, seed, wanted);
    ASSERT_EQ(kin_.joints_at_tip(abc, p_BT, tool, seed, X, q), status);
    if (status != KinStatus::kOk) continue;
    EXPECT_LT((q - wanted).lpNorm<Eigen::Infinity>(), kMm) << words.transpose();
    EXPECT_LT((X.R - R).norm(), kRad);
    ASSERT_EQ(kin_.forward(q, X_reached), KinStatus::kOk);
    EXPECT_LT((X_reached.p - R * tool - p_BT).norm(), kMm);
  }
}

TEST_P(EveryMachine, GarbageInIsAStatusNeverANan) {
  Sampler sampler(loaded_, 6);
  for (int round = 0, n = test::rounds(20000); round < n && !HasFailure(); ++round) {
    const auto some = [&](double sane) { return sampler.below(4) == 0 ? sampler.garbage() : sane; };
    JointVec q = sampler.joints(), seed = sampler.joints(), out;
    Pose X, X_out;
    kin_.forward(q, X);
    for (double& value : q) value = some(value);
    for (double& value : seed) value = some(value);
    if (sampler.below(8) == 0) seed.resize(sampler.below(kMaxJoints + 1));
    if (seed.size() != q.size()) seed.setZero();
    for (int i = 0; i < 3; ++i) X.p[i] = some(X.p[i]);
    if (round % 2) X.R(sampler.below(3), sampler.below(3)) = sampler.garbage();
    kin_.forward(q, X_out);
    EXPECT_TRUE(X_out.p.allFinite() && X_out.R.allFinite());
    const KinStatus status = kin_.inverse(X, seed, out);
    EXPECT_TRUE(out.size() == kin_.joint_count() && out.allFinite()) << to_string(status);
    Words words = Words::Constant(sampler.garbage()), words_out;
    for (double& value : words) value = some(value);
    kin_.joints_from_words(words, out);
    EXPECT_TRUE(out.size() == kin_.joint_count() && out.allFinite());
    kin_.words_from_joints(q, words_out);
    EXPECT_TRUE(words_out.allFinite());
    Vec3 abc;
    kin_.words_for_axis(words.head<3>(), words.tail<3>(), abc);
    EXPECT_TRUE(abc.allFinite());
    kin_.joints_at_tip(words.tail<3>(), X.p, Vec3(0, 0, some(100)), seed, X_out, out);
    EXPECT_TRUE(out.size() == kin_.joint_count() && out.allFinite());
  }
}

TEST_P(EveryMachine, NothingAllocatesAndNothingRemembers) {
  Sampler sampler(loaded_, 7);
  const LoadedMachine other = load_machine(GetParam());
  for (int round = 0; round < 2000 && !HasFailure(); ++round) {
    const JointVec q = sampler.joints(), seed = sampler.near(q);
    Pose X, X_again;
    JointVec out, out_again;
    Words words;
    Vec3 abc;
    const long before = allocation_count();
    kin_.forward(q, X);
    kin_.inverse(X, seed, out);
    kin_.words_from_joints(out, words);
    kin_.joints_from_words(words, out);
    kin_.words_for_axis(X.R.col(2), Vec3(0.1, 0.2, 0.3), abc);
    kin_.orientation(abc);
    kin_.joints_at_tip(abc, X.p, Vec3(0, 0, 100), seed, X_again, out);
    kin_.inverse(X, seed, out);
    EXPECT_EQ(allocation_count(), before);
    other.kinematics->forward(q, X_again);
    other.kinematics->inverse(X_again, seed, out_again);
    EXPECT_EQ(X.p, X_again.p);
    EXPECT_EQ(X.R, X_again.R);
    EXPECT_EQ(out, out_again);
  }
}

TEST(AllocationCounter, Counts) {
  const long before = allocation_count();
  const std::vector<std::string> some(10, std::string(100, 'x'));
  EXPECT_TRUE(before == -1 || allocation_count() >= before + 11) << some.size();
}

INSTANTIATE_TEST_SUITE_P(Configs, EveryMachine, testing::ValuesIn(all_machines()),
                         [](const auto& each) { return each.param; });

}  // namespace
}  // namespace trn

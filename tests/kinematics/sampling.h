#pragma once

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <random>

#include "core/axes.h"
#include "core/frames.h"
#include "core/ports.h"
#include "core/units.h"
#include "kinematics/platform_kinematics.h"
#include "tests/kinematics/machines.h"

namespace trn {

/// Seeded poses of a machine: anywhere, at limits, near poles.
class Sampler {
 public:
  Sampler(const LoadedMachine& loaded, unsigned seed) : loaded_(loaded), random_(seed) {}

  double uniform(double min, double max) { return std::uniform_real_distribution<>(min, max)(random_); }
  int below(int n) { return std::uniform_int_distribution<>(0, n - 1)(random_); }

  /// Joints of a legal pose.
  JointVec joints() {
    const auto* platform = dynamic_cast<const PlatformKinematics*>(loaded_.kinematics.get());
    return platform ? platform_joints(*platform) : serial_joints();
  }

  /// A seed near q, as another place of the path would give.
  JointVec near(JointVec q) {
    for (Eigen::Index i = 0; i < q.size(); ++i) q[i] += uniform(-0.2, 0.2);
    return q;
  }

  Vec3 direction() {
    std::normal_distribution<> normal;
    return Vec3(normal(random_), normal(random_), normal(random_)).normalized();
  }

  /// Any bit pattern a double can have, often the nasty ones.
  double garbage() {
    static constexpr double kNasty[] = {NAN,    INFINITY, -INFINITY, 0.0,  -0.0,
                                        5e-324, 1.7e308,  -1.7e308,  1e17, 1.0};
    if (below(2) == 0) return kNasty[below(10)];
    const std::uint64_t bits = std::uniform_int_distribution<std::uint64_t>()(random_);
    double value = 0;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }

 private:
  bool within_limits(const JointVec& q) const {
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      const JointLimit& limit = loaded_.machine.joints[static_cast<std::size_t>(i)].limit;
      if (q[i] < limit.min || q[i] > limit.max) return false;
    }
    return true;
  }

  JointVec serial_joints() {
    const auto& joints = loaded_.machine.joints;
    JointVec q(static_cast<Eigen::Index>(joints.size()));
    for (std::size_t i = 0; i < joints.size(); ++i) {
      // An endless joint: some turns. Beyond, an angle has fewer digits behind its point than the judges ask
      // for.
      constexpr double kTurns_rad = 125;
      const bool endless = joints[i].endless;
      const JointLimit limit = {.min = endless ? -kTurns_rad : joints[i].limit.min,
                                .max = endless ? kTurns_rad : joints[i].limit.max};
      const int kind = below(8);
      double value = uniform(limit.min, limit.max);
      if (kind == 0) value = below(2) == 0 ? limit.min : limit.max;
      if (kind == 1) value = std::pow(10.0, -uniform(0, 14)) * (below(2) == 0 ? 1 : -1);
      if (kind == 2 && below(4) == 0) value = 0;
      q[static_cast<Eigen::Index>(i)] = value;
    }
    return q;
  }

  JointVec platform_joints(const PlatformKinematics& platform) {
    const Vec3 home = platform.spindle_from_platform(translation(home_)).p;
    for (;;) {
      Words words;
      words << home + Vec3(uniform(-150, 150), uniform(-150, 150), uniform(-120, 120)), uniform(-0.7, 0.7),
          uniform(-0.7, 0.7), 0;
      if ((platform.word_mask() & (1u << kB)) == 0) words[kB] = 0;
      JointVec q;
      if (platform.joints_from_words(words, q) == KinStatus::kOk && within_limits(q)) return q;
    }
  }

  const LoadedMachine& loaded_;
  std::mt19937_64 random_;
  Vec3 home_ = loaded_.machine.root.table("kinematics").vec3("home_mm", Vec3::Zero());
};

}  // namespace trn

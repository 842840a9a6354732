#include "kernel/setpoint_check.h"

#include <cmath>

#include "core/check.h"

namespace trn {

namespace {
constexpr double kRounding = 1e-6;  // of a position limit and, relatively, of a step: mm, rad
constexpr double kNoStep = 1e-12;   // mm, rad
}  // namespace

SetpointVerdict check_setpoints(const Joints& joints, double period_s, const JointVec& q_last,
                                const JointVec& q) TRN_RT {
  TRN_CHECK(static_cast<std::size_t>(q.size()) == joints.size() && q.size() == q_last.size());
  TRN_CHECK(period_s > 0);
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const JointLimit& limit = joints[i].limit;
    const auto k = static_cast<Eigen::Index>(i);
    const double step = q[k] - q_last[k];
    if (step == 0) continue;  // a joint that stands outside its range (after a crash) may stay there
    // Said the other way round, a step that is not a number would pass.
    const bool slow = std::abs(step) <= limit.velocity * period_s * (1 + kRounding) + kNoStep;
    if (!slow) return {Fault::kSetpointJump, static_cast<int>(i)};
    const bool outside =
        (q[k] > limit.max + kRounding && step > 0) || (q[k] < limit.min - kRounding && step < 0);
    if (outside) return {Fault::kJointLimit, static_cast<int>(i)};
  }
  return {};
}

}  // namespace trn

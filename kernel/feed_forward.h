#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/axes.h"
#include "core/joint_model.h"
#include "core/motion.h"
#include "core/ports.h"
#include "kernel/motion_queue.h"
#include "kernel/rate_follower.h"
#include "kernel/rate_plan.h"

namespace trn {

/// Velocity and acceleration of every motor joint, mm or rad per s and s^2.
struct JointRate {
  JointVec v, a;
};

/// What the drives are told beside the position: the velocity that the plan has at the moment at which the
/// setpoint acts, and the force that the joint's model needs for it. On the path both follow from the blocks'
/// own derivatives and the rate plan; in a jog, a detour or between corrections from the setpoints
/// themselves.
class FeedForward {
 public:
  /// None: the drives are told positions only, and a step does nothing.
  FeedForward(const std::optional<FeedForwardConfig>& config, const Joints& plan_joints, double period_s);

  bool on() const TRN_RT { return config_.has_value(); }

  /// A period on the path: `place` is where the period's setpoint lies, `rate` how plan time passes there.
  void follow_plan(const MotionQueue& queue, const PlanPlace& place, const RateFollower& rate) TRN_RT;
  /// A period in which the joints go elsewhere: `q` is the plan's setpoint.
  void follow_setpoints(const JointVec& q) TRN_RT;
  /// A period in which the drives obey no setpoint, or the joints stand.
  void stand(const JointVec& q) TRN_RT;
  /// Writes the offsets for this period; `q`: the plan's setpoint.
  void tell(const JointVec& q, Setpoints& setpoints) TRN_RT;

 private:
  static constexpr std::uint64_t kBlocksAhead = 64;

  void keep_position(const JointVec& q) TRN_RT;
  const JointVec& past(std::size_t periods) const TRN_RT { return past_[(newest_ + periods) % past_.size()]; }
  bool look_at(const MotionQueue& queue, PlanPlace place, double ahead_s, const RateState& state) TRN_RT;
  void derive(const MotionBlock& block, std::size_t segment, double t, const RateState& state) TRN_RT;

  std::optional<FeedForwardConfig> config_;
  double period_s_, ahead_s_ = 0, back_ = 0;  ///< `back_`: part of a period before the newest moment
  JointVec jerk_;                             ///< of the plan's limits, the unit of JointMotion
  JointRate now_, before_;                    ///< at the newest moment looked at, and a period before
  std::array<JointVec, 4> past_;  ///< setpoints, the newest at `newest_`, the others behind it in turn
  std::size_t newest_ = 0;
  JointVec standing_;  ///< zeros
};

}  // namespace trn

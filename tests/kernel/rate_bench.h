#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/axes.h"
#include "core/motion.h"
#include "kernel/motion_queue.h"
#include "kernel/rate/rate_walk.h"

// One joint whose planned motion is given by hand, for the tests of what a rate may do.
namespace trn {

inline constexpr double kPeriodS = 1e-3;
inline constexpr double kSpeed = 100, kAccel = 1000, kJerkMax = 20000;  // mm/s, mm/s^2, mm/s^3

inline Joints one_joint() {
  Joint joint;
  joint.name = "X";
  joint.limit.velocity = kSpeed;
  joint.limit.acceleration = kAccel;
  joint.limit.jerk = kJerkMax;
  return {joint};
}

/// A segment in which the joint begins with v and a and has this jerk; mm and s.
struct JointSegment {
  double duration_s, v, a = 0, j = 0;
};

/// A block of these segments. The walk looks at nothing but their durations and the joint's motion.
inline MotionBlock joint_block(const std::vector<JointSegment>& segments, bool ends_at_rest = false) {
  MotionBlock block;
  block.ends_at_rest = ends_at_rest;
  for (const JointSegment& segment : segments) {
    const std::size_t k = block.segment_count++;
    block.segments[k].duration_s = segment.duration_s;
    JointMotion& joint = block.joints[k];
    joint.v[0] = static_cast<float>(segment.v / kJerkMax);
    joint.a[0] = static_cast<float>(segment.a / kJerkMax);
    joint.a_end[0] = static_cast<float>((segment.a + segment.duration_s * segment.j) / kJerkMax);
    joint.j_min[0] = joint.j_max[0] = static_cast<float>(segment.j / kJerkMax);
  }
  return block;
}

/// A queue with these blocks, and walks that begin at its front.
class RateRoad {
 public:
  RateRoad(const MotionBlock& block) : RateRoad(std::vector<MotionBlock>(1, block)) {}
  explicit RateRoad(const std::vector<MotionBlock>& blocks) : queue_(blocks.size() + 63) {
    for (const MotionBlock& block : blocks) EXPECT_TRUE(queue_.push(block));
    queue_.look();
  }
  RateWalk walk(double rate, double slope, double time_s = 0) {
    return RateWalk(limits, queue_.view(), {0, 0, time_s}, rate, slope);
  }
  const PlanLimits limits{one_joint(), kPeriodS};

 private:
  MotionQueue queue_;
};

}  // namespace trn

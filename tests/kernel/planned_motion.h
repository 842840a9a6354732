#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "app/check/limit_judge.h"
#include "app/check/trace_reader.h"
#include "app/session/assembly.h"
#include "app/session/inline_rate_plans.h"
#include "app/session/pipeline.h"
#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/ports.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/interpolator.h"
#include "kernel/motion_queue.h"
#include "kernel/path_rate.h"
#include "kernel/rate_plan.h"

// What the tests of override and hold share: a whole program planned beforehand, and the joints it stands for
// at any plan time.
namespace trn {

class PlannedMotion {
 public:
  /// `period_s`: 0: that of the config.
  PlannedMotion(const std::string& config, const std::string& program, double period_s = 0)
      : assembly_(assemble(config)) {
    if (period_s > 0) set_period(assembly_, period_s);
    Parameters parameters;
    ToolTable tools;
    Setpoints setpoints;
    Feedback feedback;
    setpoints.q.setZero(static_cast<Eigen::Index>(assembly_.machine.joints.size()));
    setpoints.qd = feedback.q = setpoints.q;
    assembly_.drives->exchange(setpoints, feedback);
    Pipeline pipeline(assembly_, parameters, tools, {"test", program, feedback.q}, {});
    MotionBlock block;
    while (pipeline.next(block)) {
      begin_s_.push_back(length_s_);
      for (int i = 0; i < block.segment_count; ++i)
        length_s_ += block.segments[static_cast<std::size_t>(i)].duration_s;
      if (block.ends_at_rest) rests_s_.push_back(length_s_);
      blocks_.push_back(block);
    }
  }

  const Assembly& assembly() const { return assembly_; }
  const Joints& joints() const { return assembly_.plan_joints; }
  const std::vector<MotionBlock>& blocks() const { return blocks_; }
  double length_s() const { return length_s_; }
  /// The next full stop behind a plan time; a period ends there.
  double rest_after(double time_s) const {
    const auto rest = std::upper_bound(rests_s_.begin(), rests_s_.end(), time_s + 1e-9);
    return rest == rests_s_.end() ? length_s_ : *rest;
  }
  /// Plan time at the beginning of the block with this number, from 1; the end's behind the last.
  double begin_s(std::uint32_t number) const {
    return number - 1 < begin_s_.size() ? begin_s_[number - 1] : length_s_;
  }

  /// The joints at a plan time; the end's behind the end.
  JointVec q(double time_s) const {
    const auto after = std::upper_bound(begin_s_.begin(), begin_s_.end(), time_s);
    std::size_t k = static_cast<std::size_t>(after - begin_s_.begin()) - (after == begin_s_.begin() ? 0 : 1);
    while (k > 0 && blocks_[k].segment_count == 0) --k;
    while (k + 1 < blocks_.size() && blocks_[k].segment_count == 0) ++k;  // it begins with events
    double t = time_s - begin_s_[k];
    const MotionBlock& block = blocks_[k];
    int i = 0;
    const auto duration = [&](int at) { return block.segments[static_cast<std::size_t>(at)].duration_s; };
    while (i + 1 < block.segment_count && t > duration(i)) t -= duration(i++);
    JointVec out;
    const TimeSegment& segment = block.segments[static_cast<std::size_t>(i)];
    assembly_.map->map(block.piece.at(segment.s_at(std::min(t, segment.duration_s))), block.context, out);
    return out;
  }

 private:
  Assembly assembly_;
  std::vector<MotionBlock> blocks_;
  std::vector<double> begin_s_, rests_s_;
  double length_s_ = 0;
};

/// The judge of a stream of joints, row by row, at rest before the first.
class JointJudge {
 public:
  JointJudge(const Joints& joints, double step_s)
      : joints_(joints), step_s_(step_s), judge_(joints, step_s) {}
  void operator()(const JointVec& q) {
    row_.t_s = static_cast<double>(judge_.rows()) * step_s_;
    row_.q.assign(q.data(), q.data() + q.size());
    row_.digits.assign(row_.q.size(), WrittenDigits{17, 17});
    judge_.row(row_);
  }
  /// The worst ratio of velocity, acceleration and jerk.
  double worst(std::string* where = nullptr) const {
    double worst = 0;
    for (std::size_t i = 0; i < joints_.size(); ++i)
      for (const Quantity quantity : {Quantity::kVelocity, Quantity::kAcceleration, Quantity::kJerk}) {
        const Peak& peak = judge_.verdicts()[i].peak(quantity);
        if (peak.ratio <= worst) continue;
        worst = peak.ratio;
        if (where) *where = joints_[i].name + " " + to_string(quantity) + " at " + std::to_string(peak.t_s);
      }
    return worst;
  }

 private:
  const Joints& joints_;
  double step_s_;
  LimitJudge judge_;
  TraceRow row_;
};

/// The tick's motion alone: queue, interpolator and rate, with the plan time they have reached.
class RateBench {
 public:
  RateBench(const PlannedMotion& motion, std::size_t capacity)
      : motion_(motion),
        queue_(capacity),
        interpolator_(queue_, Pose()),
        plans_(motion.joints(), motion.assembly().machine.period_s),
        rate_(plans_, motion.assembly().machine.period_s) {
    fill(1e9);
  }
  /// Pushes blocks until `ahead_s` of plan time are queued.
  void fill(double ahead_s) {
    while (next_ < motion_.blocks().size() && queue_.buffered_s() < ahead_s &&
           queue_.push(motion_.blocks()[next_]))
      ++next_;
    queue_.look();
  }
  /// One period; `see(plan_time)` is called for each of `density` parts of it.
  template <typename See>
  Interpolator::Outcome tick(double target, int density, See see) {
    queue_.look();
    const double passed = interpolator_.at_rest() ? rate_.start(queue_, target)
                                                  : rate_.step(queue_, interpolator_.place(), {target});
    const double rest_s = motion_.rest_after(time_s_);
    for (int i = 1; i <= density; ++i)
      see(std::min(time_s_ + rate_.plan_time_at(static_cast<double>(i) / density), rest_s));
    time_s_ = std::min(time_s_ + passed, rest_s);
    return passed > 0 ? interpolator_.advance(passed) : Interpolator::Outcome::kMoving;
  }
  double time_s() const { return time_s_; }
  const PathRate& rate() const { return rate_; }
  const Interpolator& interpolator() const { return interpolator_; }
  MotionQueue& queue() { return queue_; }

 private:
  const PlannedMotion& motion_;
  MotionQueue queue_;
  Interpolator interpolator_;
  InlineRatePlans plans_;
  PathRate rate_;
  std::size_t next_ = 0;
  double time_s_ = 0;
};

}  // namespace trn

#pragma once

#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"
#include "kernel/motion_queue.h"
#include "kernel/rate_plan.h"

namespace trn {

/// Evaluates the planned motion at the plan's own time. Decides nothing: how fast plan time passes is the
/// time scale's business, what to do at an event the cycle's.
class Interpolator {
 public:
  Interpolator(MotionQueue& queue, const Pose& X_WB_idle) : queue_(queue) { at_.context.X_WB = X_WB_idle; }

  enum class Outcome : unsigned char {
    kMoving,   ///< y() is on the way
    kAtRest,   ///< at the end of a stretch (or nowhere yet) and the queue is empty
    kAtEvent,  ///< at rest in front of `event()`
    kStarved,  ///< the queue is empty in the middle of a stretch; y() is its end
    kBroken,   ///< more blocks ended in one period than any plan has: a defect
  };

  /// Lets `plan_time_s` pass; stops at the end of a stretch and in front of an event.
  Outcome advance(double plan_time_s) TRN_RT;

  /// Where the motion is; valid after the first block.
  const Words& y() const TRN_RT { return at_.y; }
  /// Of the motion; before the first block: of the first one ahead, if that is known.
  const MapContext& context() const TRN_RT { return at_.context; }
  SourceLine source() const TRN_RT { return at_.source; }
  const OverrideMode& overrides() const TRN_RT { return at_.overrides; }
  bool has_position() const TRN_RT { return has_position_; }
  /// The joints go elsewhere, by a jog or in homing: y is no place of theirs any more.
  void leave_path() TRN_RT { has_position_ = false; }
  bool at_rest() const TRN_RT { return at_.at_rest; }
  bool begun() const TRN_RT { return at_.begun; }
  /// Where it stands, to go away from and return to.
  struct Stand {
    double time_s = 0;  ///< in the segment
    int segment = 0;
    bool at_rest = true;
    bool begun = false;  ///< the front block's outputs are taken
    Words y = Words::Zero();
    MapContext context;
    OverrideMode overrides;
    SourceLine source;
  };
  const Stand& stand() const TRN_RT { return at_; }
  /// The queue's front is again what it was.
  void return_to(const Stand& stand) TRN_RT { at_ = stand; }
  /// Elsewhere on the path: in this block, which becomes the front.
  void go_to(const PlanPlace& place, const MotionBlock& block) TRN_RT;
  /// Where in the queue's plan that is.
  PlanPlace place() const TRN_RT { return {queue_.front_number(), at_.segment, at_.time_s}; }

  /// Output changes of the blocks that have begun since the last call.
  OutputChanges take_outputs() TRN_RT;
  /// The event in front; call `pass_event` to go on behind it.
  const MotionBlock& event() const TRN_RT { return *queue_.front(); }
  void pass_event() TRN_RT { queue_.pop(); }

  /// Stands here, in the middle of the path: leaves out the blocks up to the next event, at most
  /// kBlocksPerTick. True when that stands in front.
  bool skip_to_event() TRN_RT;
  /// Stands still here and forgets the rest of the queue.
  void abandon() TRN_RT;

 private:
  static constexpr int kBlocksPerTick = 256;

  void begin_front(const MotionBlock& block) TRN_RT;
  void look_for_context() TRN_RT;
  void evaluate(const MotionBlock& block) TRN_RT;

  MotionQueue& queue_;
  Stand at_;
  bool has_position_ = false;
  OutputChanges outputs_;
};

}  // namespace trn

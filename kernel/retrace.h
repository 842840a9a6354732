#pragma once

#include <cstddef>
#include <cstdint>

#include "core/axes.h"
#include "core/motion.h"
#include "core/realtime.h"
#include "kernel/interpolator.h"
#include "kernel/motion_queue.h"
#include "kernel/rate_plan.h"
#include "kernel/s_curve.h"
#include "kernel/time_scale.h"

namespace trn {

/// The way back along the path while the motion stands in a hold, and forward again, up to the place of the
/// hold. Plan time passes at no more than half its pace there, so that the joints' limits leave room for
/// every beginning and end whatever the path is. It goes back to the last event, output or change of tool or
/// tool centre point control, and no farther than MotionQueue keeps blocks; so nothing has to be undone.
/// Where it ends the motion stands as if it had been held there, and goes on from there.
class Retrace {
 public:
  static constexpr double kRateMax = 0.5;  ///< of the plan's pace
  /// Of a queue from which a motion shall be retraced: MotionQueue's `past`.
  static constexpr std::size_t kBlocksKept = 2048;

  /// All must outlive this.
  Retrace(const Joints& joints, double period_s, MotionQueue& queue, Interpolator& interpolator);

  /// It moves, or is about to.
  bool moves() const TRN_RT { return state_ != State::kStands; }
  /// It was moved since the hold, which may still be where it is.
  bool away() const TRN_RT { return away_; }
  /// The motion stands in a hold. `way_mm` of the path (a degree of the rotary words counts as a millimetre):
  /// below 0 back, above 0 forward.
  void go(double way_mm) TRN_RT;
  /// It comes to rest where it can.
  void stop() TRN_RT { stops_ = true; }
  /// One period at this share of its pace, 0 to 1. True: the interpolator has moved.
  bool step(double rate) TRN_RT;
  /// Of the plan's time, negative backwards.
  double rate() const TRN_RT { return rate_; }
  /// How much of the path lies between the place of the hold and here.
  double behind_mm() const TRN_RT { return behind_mm_; }
  /// At the place of the hold.
  bool at_hold() const TRN_RT;
  /// What was asked for is more than there is.
  bool at_end() const TRN_RT { return at_end_; }
  /// The motion goes on, or is given up.
  void forget() TRN_RT;

 private:
  enum class State : std::uint8_t { kStands, kLooks, kMoves };
  static constexpr int kBlocksPerTick = 64;

  void look() TRN_RT;
  bool look_back(const MotionBlock& block) TRN_RT;
  bool look_forward(const MotionBlock& block) TRN_RT;
  bool meets_hold() TRN_RT;
  bool enter_next(bool back) TRN_RT;
  bool reaches(const TimeSegment& segment, double from_s, double to_s) TRN_RT;
  bool leads_back_from(std::uint64_t number) const TRN_RT;
  void set_off() TRN_RT;
  void walk(double plan_time_s) TRN_RT;
  void come_to_rest() TRN_RT;
  const MotionBlock& block(std::uint64_t number) const TRN_RT;

  MotionQueue& queue_;
  Interpolator& interpolator_;
  TimeScale time_scale_;
  double slope_max_, bend_max_;  ///< of the rate, 1/s and 1/s^2
  State state_ = State::kStands;
  bool away_ = false;  ///< `held_` and `hold_` are those of a hold
  Interpolator::Stand held_;
  PlanPlace hold_, here_;            ///< of the hold; of the motion
  PlanPlace seen_;                   ///< up to where `look` has come
  double left_mm_ = 0, seen_s_ = 0;  ///< of the wish, behind `seen_`; plan time up to there
  int sense_ = -1;                   ///< -1 back, 1 forward
  bool stops_ = false, at_end_ = false;
  SCurve curve_;  ///< plan time gone
  double time_s_ = 0, gone_s_ = 0;
  double rate_ = 0, behind_mm_ = 0;
  double period_s_;
};

}  // namespace trn

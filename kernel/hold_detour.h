#pragma once

#include <cstdint>

#include "core/axes.h"
#include "core/ports.h"
#include "core/realtime.h"
#include "kernel/joint_jog.h"
#include "kernel/joint_ramp.h"
#include "kernel/rt_messages.h"
#include "kernel/tick_io.h"
#include "kernel/time_scale.h"
#include "kernel/way_out.h"

namespace trn {

/// What the operator does while the motion stands in a hold, and the way back from it: jogs lead away, and
/// the spindle, the coolant and outputs may be switched. The way back gives those back what the program had
/// set, waits for the spindle's speed before the last corner, and ends at the place of the hold to the bit.
/// It follows the corners of the jogs in reverse, because that way was free, from rest to rest at each.
class HoldDetour {
 public:
  /// Of the joints' limits, on the way back: slow, and with half of them left to stop it.
  static constexpr PlanShares kShares{0.5, 0.5, 0.25};

  /// All must outlive this; `jog` is used by nobody else while the detour is under way.
  HoldDetour(const Joints& joints, double period_s, double spindle_timeout_s, JointJog& jog, TickIo& io);

  DetourState state() const TRN_RT { return state_; }
  /// The machine may stand elsewhere than at the hold, or an output differs.
  bool under_way() const TRN_RT { return state_ != DetourState::kNone; }
  /// On the way back, or about to be.
  bool goes_back() const TRN_RT { return back_wanted_ || (state_ == DetourState::kReturns && !held_); }
  /// Jogs and switches are obeyed.
  bool obeys() const TRN_RT { return !goes_back() && (state_ == DetourState::kJogs || !moves()); }
  /// A joint may move in this period.
  bool moves() const TRN_RT;
  bool full() const TRN_RT { return state_ != DetourState::kNone && way_.full(); }
  /// Of the way back.
  double rate() const TRN_RT { return ramp_.rate(); }

  /// The machine has stood at q (mm, rad) for `kStillPeriods`, in the hold or in a way back that is held. The
  /// arguments are JointJog's. False: there is no room for more corners.
  bool jog(const JointVec& q, int joint, double way, double speed) TRN_RT;
  /// Switches what the command names. The machine stands at q.
  void switch_output(const JointVec& q, const RtCommand& command) TRN_RT;
  /// Ends jogs, or stops the way back until `lead_back`.
  void hold() TRN_RT;
  /// Begins the way back, or goes on with it.
  void lead_back() TRN_RT;
  /// One period at this share of the speeds, 0 to 1; the joints at its end.
  JointVec step(const JointVec& q, double rate) TRN_RT;
  /// It was not ready in time.
  bool spindle_failed() const TRN_RT { return spindle_failed_; }
  /// The way back has ended at the place of the hold, and outputs are as the program has set them.
  bool ended() const TRN_RT { return ended_; }
  void forget() TRN_RT;

 private:
  void begin(const JointVec& q) TRN_RT;
  JointVec step_jog(double rate) TRN_RT;
  JointVec step_back(const JointVec& q, double rate) TRN_RT;
  bool waits_for_spindle() TRN_RT;

  double period_s_, spindle_timeout_s_;
  JointJog& jog_;
  JointRamp ramp_;
  TickIo& io_;
  WayOut way_;
  DetourState state_ = DetourState::kNone;
  bool on_leg_ = false;       ///< on the way to the last corner of `way_`
  bool held_ = false;         ///< the way back
  bool back_wanted_ = false;  ///< as soon as the jogs have come to rest
  bool ended_ = false, spindle_failed_ = false;
  int still_ = 0;               ///< periods without motion, up to kStillPeriods
  bool switched_ = false;       ///< outputs differ from `outputs_`
  IoOutputs outputs_;           ///< as the program has set them
  std::int64_t restored_ = -1;  ///< periods since they were given back; -1: not yet
};

}  // namespace trn

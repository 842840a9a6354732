#pragma once

#include "core/frames.h"
#include "core/realtime.h"

namespace trn {

/// Rigid tapping: spindle and tip geared, down, through standstill, and back. The path says where the spindle
/// shall be: the tip's distance from where the tap began, over the pitch. The spindle is told the speed of
/// that and a correction of its angle; plan time waits for a spindle that is behind, as its encoder tells,
/// and hurries after one that is ahead. Stepped once a period: rate, follow_tip, spindle_rpm.
class TapGear {
 public:
  explicit TapGear(double period_s) : period_s_(period_s) {}

  /// The spindle stands at `turns`. `turns_s`: of the plan at full speed, signed (+ clockwise).
  void begin(double turns, double turns_s, double per_turn_mm) TRN_RT;
  void end() TRN_RT { active_ = false; }
  bool active() const TRN_RT { return active_; }

  /// Rate of plan time for this period; `turns`: of the encoder at the end of the one before.
  double rate(double turns) const TRN_RT;
  /// Where the path has the tip at the end of this period.
  void follow_tip(const Vec3& tip) TRN_RT;
  /// What the spindle is told for this period.
  double spindle_rpm(double turns) TRN_RT;

  /// Path and spindle stand where they belong.
  bool settled(double turns) const TRN_RT;
  /// The spindle is so far off that the tap is about to break.
  bool lost(double turns) const TRN_RT;

 private:
  double period_s_;
  bool active_ = false;
  bool has_from_ = false;
  Vec3 from_ = Vec3::Zero();  ///< the tip where the tap began
  double turns_from_ = 0, turns_s_ = 1, per_turn_mm_ = 1;
  double wanted_ = 0;         ///< turns that the path stands for, at the end of this period
  double wanted_before_ = 0;  ///< at the end of the one before
  double forward_ = 1;        ///< sense in which they last changed
  double speed_ = 0;          ///< of theirs, turns a second
};

}  // namespace trn

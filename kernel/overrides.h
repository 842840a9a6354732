#pragma once

#include "core/motion.h"
#include "core/realtime.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"

namespace trn {

/// How fast the operator and the program want the motion and the spindle, as shares of what is programmed.
class Overrides {
 public:
  static constexpr double kMax = 2;

  /// Takes what an override's command sets; false: the command is none of them.
  bool obey(const RtCommand& command) TRN_RT;
  /// The program's own switches (M48 to M53), as far as the motion has come.
  void set_mode(const OverrideMode& mode) TRN_RT { mode_ = mode; }
  void reset_mode() TRN_RT { mode_ = {}; }

  double feed() const TRN_RT { return feed_; }
  /// Wanted rate of the motion that `block` begins; null: nothing is in front.
  double motion(const MotionBlock* block) const TRN_RT;
  /// Factor of the spindle's speed; a tap leaves its spindle alone.
  double spindle(bool taps) const TRN_RT { return mode_.spindle && !taps ? spindle_ : 1.0; }

 private:
  double feed_ = 1, rapid_ = 1, spindle_ = 1, adaptive_feed_ = 1;
  OverrideMode mode_;
};

}  // namespace trn

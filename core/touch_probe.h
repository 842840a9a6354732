#pragma once

#include "core/axes.h"
#include "core/realtime.h"

namespace trn {

/// What a touch probe on the drives' own inputs says: they take their positions at the change, not with the
/// period.
struct TouchProbe {
  bool contact = false;       ///< the probe is closed
  bool armed = false;         ///< every drive waits for the change
  unsigned latched_mask = 0;  ///< bit i: joint i has taken its position
  JointVec q;                 ///< of these joints, mm or rad
};

/// What drives with a touch probe of their own offer beside `Drives`. In the tick.
class TouchDrives {
 public:
  virtual ~TouchDrives() = default;
  /// Periods within which they are armed, and have told where they were at the contact; 0: no probe is wired.
  virtual int touch_periods() const TRN_RT = 0;
  /// Waits for the probe to close (`contact`) or to open.
  virtual void arm_touch(bool contact) TRN_RT = 0;
  virtual void disarm_touch() TRN_RT = 0;
  /// As of the last exchange.
  virtual const TouchProbe& touch() const TRN_RT = 0;
};

}  // namespace trn

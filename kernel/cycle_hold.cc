#include <algorithm>

#include "core/check.h"
#include "core/fault.h"
#include "kernel/cycle.h"
#include "kernel/hold_detour.h"
#include "kernel/joint_jog.h"
#include "kernel/retrace.h"
#include "kernel/rt_messages.h"

// What the operator does while the motion stands in a hold.
namespace trn {

// Where the operator may jog away and switch outputs: not inside a thread or a probe move.
bool Cycle::stands_in_hold() const TRN_RT {
  if (ending() || latched_.fault != Fault::kOk || !obeyed_ || switch_.settling) return false;
  if (retrace_.moves()) return false;
  if (detour_.state() == DetourState::kJogs) return detour_.obeys();
  if (still_periods_ < kStillPeriods) return false;
  if (detour_.under_way()) return detour_.obeys();
  if (io_.reads_encoder() || io_.probes()) return false;
  const bool stands = rate_.standing() || interpolator_.at_rest();
  return motion_ == MotionState::kPaused || (motion_ == MotionState::kHeld && stands);
}

void Cycle::follow_detour() TRN_RT {
  TRN_CHECK(motion_ == MotionState::kHeld || motion_ == MotionState::kPaused);
  rate_.rest(queue_);
  if (ending()) detour_.hold();
  setpoint_.q = detour_.step(setpoint_.q, std::min(1.0, overrides_.feed()));
  if (ending()) {
    if (detour_.moves()) return;
    io_.all_off();
    return abandon_motion();
  }
  if (detour_.spindle_failed()) return latch(Fault::kSpindle, -1);
  if (!detour_.ended()) return;
  detour_.forget();
  resume();
}

void Cycle::follow_retrace() TRN_RT {
  TRN_CHECK(motion_ == MotionState::kHeld);
  rate_.rest(queue_);
  if (ending()) retrace_.stop();
  const bool moved = retrace_.step(std::min(1.0, overrides_.feed()));
  report_source(interpolator_.source());
  if (moved) io_.follow_tip(interpolator_.y().head<3>());
  if (moved && !map_setpoint()) return latch(Fault::kKinematics, -1);
  if (!retrace_.moves()) end_retrace();
}

// At a program stop, too; it is one again where the motion comes back to it.
void Cycle::retrace(double way_mm) TRN_RT {
  retraced_.resumes = false;
  if (retrace_.moves() && way_mm == 0) retrace_.stop();
  const bool may = stands_in_hold() && !detour_.under_way() && dwell_left_s_ <= 0 && !switch_.pending;
  if (!may || !interpolator_.has_position() || way_mm == 0) return;
  if (!retrace_.away())
    retraced_ = {motion_ == MotionState::kPaused, wait_, report_.waits_at, {report_.line, report_.step}};
  wait_ = {};
  report_.waits_at = {};
  motion_ = MotionState::kHeld;
  retrace_.go(way_mm);
  if (!retrace_.moves()) end_retrace();
}

void Cycle::end_retrace() TRN_RT {
  rate_.stand_elsewhere();
  if (retraced_.paused && retrace_.at_hold()) {
    motion_ = MotionState::kPaused;
    wait_ = retraced_.wait;
    report_.waits_at = retraced_.waits_at;
    report_source(retraced_.source);
  }
  if (ending()) {
    io_.all_off();
    return abandon_motion();
  }
  if (retraced_.resumes) resume();
}

}  // namespace trn

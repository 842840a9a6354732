#include "kernel/hold_detour.h"

#include <algorithm>

#include "core/check.h"

namespace trn {

namespace {
constexpr std::int64_t kSpindleHears = 2;  // periods from the command to the answer
}

HoldDetour::HoldDetour(const Joints& joints, double period_s, double spindle_timeout_s, JointJog& jog,
                       TickIo& io)
    : period_s_(period_s),
      spindle_timeout_s_(spindle_timeout_s),
      jog_(jog),
      ramp_(joints, period_s, kShares),
      io_(io),
      way_(joints) {}

bool HoldDetour::moves() const TRN_RT {
  if (state_ == DetourState::kJogs) return true;
  return state_ == DetourState::kReturns && on_leg_ && ramp_.rate() > 0;
}

void HoldDetour::begin(const JointVec& q) TRN_RT {
  if (under_way()) return;
  forget();
  way_.begin(q);
  state_ = DetourState::kAway;
  switched_ = false;
}

bool HoldDetour::jog(const JointVec& q, int joint, double way, double speed) TRN_RT {
  if (!obeys()) return true;
  begin(q);
  if (way != 0 && way_.full()) return false;
  if (on_leg_) way_.turn_at(q);
  if (state_ != DetourState::kJogs) jog_.begin(q);
  jog_.move_on(joint, way, speed);
  state_ = DetourState::kJogs;
  on_leg_ = held_ = false;
  return true;
}

void HoldDetour::switch_output(const JointVec& q, const RtCommand& command) TRN_RT {
  if (!obeys()) return;
  begin(q);
  if (!switched_) outputs_ = io_.outputs();
  switched_ = true;
  restored_ = -1;
  io_.switch_by_hand(command);
}

void HoldDetour::hold() TRN_RT {
  if (state_ == DetourState::kJogs) jog_.stop();
  held_ = state_ == DetourState::kReturns;
  back_wanted_ = false;
}

void HoldDetour::lead_back() TRN_RT {
  TRN_CHECK(under_way());
  back_wanted_ = state_ == DetourState::kJogs;
  held_ = false;
  if (back_wanted_) return jog_.stop();
  state_ = DetourState::kReturns;
}

void HoldDetour::forget() TRN_RT {
  state_ = DetourState::kNone;
  ended_ = spindle_failed_ = held_ = on_leg_ = back_wanted_ = false;
}

// Only the last straight leads to the work: the spindle runs up while the machine is on those before.
bool HoldDetour::waits_for_spindle() TRN_RT {
  if (!switched_) return false;
  if (restored_ < 0) io_.give_back(outputs_);
  ++restored_;
  if (way_.count() > 1) return false;
  switched_ = restored_ < kSpindleHears || !io_.inputs().spindle_ready;
  spindle_failed_ = switched_ && static_cast<double>(restored_) * period_s_ > spindle_timeout_s_;
  return switched_;
}

JointVec HoldDetour::step_back(const JointVec& q, double rate) TRN_RT {
  const double wanted = held_ || waits_for_spindle() ? 0 : rate;
  if (!on_leg_) {
    if (wanted <= 0 || still_ < kStillPeriods) return q;
    ended_ = way_.count() == 1 && q == way_.last();
    if (ended_) return q;
    ramp_.begin_way(q, way_.last() - q, wanted);
    on_leg_ = true;
  }
  const JointVec next = ramp_.step(wanted);
  if (!ramp_.ended()) return next;
  on_leg_ = false;
  const JointVec corner = way_.last();
  way_.go_back();
  return corner;
}

JointVec HoldDetour::step_jog(double rate) TRN_RT {
  if (way_.full()) jog_.stop();
  const JointVec next = jog_.step(rate);
  way_.visit(next);
  if (!jog_.ended()) return next;
  state_ = back_wanted_ ? DetourState::kReturns : DetourState::kAway;
  back_wanted_ = false;
  return next;
}

JointVec HoldDetour::step(const JointVec& q, double rate) TRN_RT {
  TRN_CHECK(under_way());
  JointVec next = q;
  if (state_ == DetourState::kReturns)
    next = step_back(q, rate);
  else if (state_ == DetourState::kJogs)
    next = step_jog(rate);
  still_ = next == q ? std::min(still_ + 1, kStillPeriods) : 0;
  return next;
}

}  // namespace trn

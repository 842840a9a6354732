#include <algorithm>

#include "compensation/micromill/deflection_correction.h"
#include "compensation/micromill/deflection_estimator.h"
#include "core/axes.h"
#include "core/check.h"
#include "core/motion.h"
#include "kernel/cycle.h"
#include "kernel/hold_detour.h"
#include "kernel/joint_jog.h"
#include "kernel/rt_messages.h"

// What the tick tells of itself.
namespace trn {

void Cycle::report_corrections() TRN_RT {
  if (!corrections_) return;
  for (int i = 0; i < corrections_->size(); ++i) {
    auto& link = report_.corrections[static_cast<std::size_t>(i)];
    link = {corrections_->offset(i), corrections_->enabled(i), corrections_->warning(i)};
  }
}

void Cycle::report_tool_load() TRN_RT {
  const DeflectionCorrection* source = corrections_ ? corrections_->deflection() : nullptr;
  if (!source) return;
  const DeflectionEstimator::Output& estimate = source->estimate();
  report_.tool_load = {estimate.force_N, estimate.deflection_mm, corrections_->deflection_shift_mm(),
                       estimate.known && source->config().trained, estimate.alarm};
}

void Cycle::report_source(const SourceLine& source) TRN_RT {
  report_.line = source.line;
  report_.step = source.step;
}

void Cycle::report_place() TRN_RT {
  const Words y_before = report_.y;
  const bool was_on_path = report_.on_path;
  const bool still = setpoint_.q == report_.q_plan;
  still_periods_ = still ? std::min(still_periods_ + 1, kStillPeriods) : 0;
  report_.q_plan = setpoint_.q;
  report_.q_setpoint = setpoint_.q_sent;
  report_.q_measured = feedback_.q;
  report_.current_A = feedback_.current_A;
  report_.force = feedback_.force;
  report_.words = feedback_.words;
  report_.y = interpolator_.y();
  report_.context = interpolator_.context();
  report_.on_path = interpolator_.has_position() && !switch_.off_path && !detour_.under_way();
  report_.speed_mm_s =
      was_on_path && report_.on_path ? (report_.y - y_before).head<3>().norm() / config_.period_s : 0;
  report_.rate_plan_late = rate_.late();
  report_.late_rate_plans = rate_.late_answers();
  report_.override_now = rate_.rate();
  if (switch_.settling) report_.override_now = ramp_.rate();
  if (retrace_.moves()) report_.override_now = retrace_.rate();
  if (detour_.goes_back()) report_.override_now = detour_.rate();
  if (motion_ == MotionState::kJogging || detour_.state() == DetourState::kJogs)
    report_.override_now = std::min(1.0, overrides_.feed());
}

void Cycle::report_io() TRN_RT {
  report_.spindle_rpm = io_.told_rpm(overrides_.spindle(io_.taps()));
  report_.coolant = io_.outputs().coolant;
  report_.inputs = io_.inputs().digital;
  report_.outputs = io_.outputs().digital;
  report_.probe = io_.inputs().probe;
  report_.spindle_ready = io_.inputs().spindle_ready;
  report_.reads_encoder = io_.reads_encoder();
  report_.gear_lag_s = io_.geared() ? io_.gear_lag_s() : 0;
  report_.spindle_turns = io_.inputs().spindle_turns;
}

// Motion that the program waits for, as a way back, is motion.
MotionState Cycle::shown_motion() const TRN_RT {
  const bool held = motion_ == MotionState::kHeld || detour_.under_way();
  if ((held && ending()) || detour_.goes_back()) return MotionState::kMoving;
  return detour_.state() == DetourState::kReturns ? MotionState::kHeld : motion_;
}

void Cycle::write_report() TRN_RT {
  report_.period = period_++;
  TRN_CHECK(motion_ != MotionState::kRest || (!ending() && !wait_.paused && !switch_.settling));
  TRN_CHECK(!wait_.paused || motion_ == MotionState::kPaused);
  TRN_CHECK(dwell_left_s_ < 1e9);
  report_place();
  report_corrections();
  report_tool_load();
  report_io();
  report_.single_block = single_block_.on();
  report_.optional_stop = optional_stop_;
  report_.machine_lock = lock_.on;
  report_.planner_late = planner_late_;
  report_.homed_mask = feedback_.homed_mask;
  report_.limit_switch_mask = feedback_.limit_switch_mask;
  report_.fault = latched_.fault;
  report_.fault_joint = latched_.joint;
  report_.failed_check = latched_.check;
  report_.motion = shown_motion();
  report_.detour = retrace_.moves() ? DetourState::kRetraces : detour_.state();
  report_.behind_mm = retrace_.behind_mm();
  report_.behind_end = retrace_.at_end();
  report_.stands_in_hold = stands_in_hold();
  report_.detour_full = detour_.full();
  report_.drives = feedback_.state;
  if (!reports_.try_push(report_)) ++report_.lost_reports;
}

}  // namespace trn

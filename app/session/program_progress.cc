#include "app/session/program_progress.h"

#include <algorithm>
#include <cmath>

#include "core/motion.h"

namespace trn {

namespace {

constexpr double kTrust_s = 2;  // so long counts what is asked for beside what was driven

// The motion goes on; what waits at an event does not.
bool passes(const CycleReport& report) {
  const bool on = report.motion == MotionState::kMoving || report.motion == MotionState::kHeld;
  return on && report.waits_at.kind == QueueEvent::Kind::kNone;
}

}  // namespace

void ProgramProgress::begin() {
  total_ = {};
  done_ = {};
  step_ = 0;
  in_step_s_ = 0;
}

void ProgramProgress::report(const CycleReport& report, const ProgramStep* step,
                             const OverrideShares& shares) {
  if (shares.feed != shares_.feed) feed_ = {};
  if (shares.rapid != shares_.rapid) rapid_ = {};
  shares_ = shares;
  if (report.motion == MotionState::kRest) {
    done_ = {};
    step_ = 0;
  }
  if (!step) return;
  if (step->source.step != step_) {
    step_ = step->source.step;
    in_step_s_ = 0;
  }
  if (passes(report)) {
    in_step_s_ += period_s_ * (step->moves ? report.override_now : 1);
    learn(report, step->timing);
  }
  done_ = step->begins_at;
  done_.add(step->timing, in_step_s_);
}

double ProgramProgress::Driven::rate(double asked) const {
  return asked == 1 ? 1 : (plan_s + kTrust_s * asked) / (time_s + kTrust_s);
}

void ProgramProgress::learn(const CycleReport& report, PlanTime::Kind kind) {
  if (report.motion != MotionState::kMoving || !(kind.rapid || kind.feed) || kind.adaptive) return;
  Driven& driven = kind.rapid ? rapid_ : feed_;
  driven.time_s += period_s_;
  driven.plan_s += period_s_ * report.override_now;
}

double ProgramProgress::left_s() const {
  if (!total_.known) return -1;
  OverrideShares driven = shares_;
  if (driven.feed > 0) driven.feed = feed_.rate(driven.feed);
  if (driven.rapid > 0) driven.rapid = rapid_.rate(driven.rapid);
  const double left_s = (total_.time - done_).real_s(driven);
  return std::isfinite(left_s) ? std::max(0.0, left_s) : -1;
}

}  // namespace trn

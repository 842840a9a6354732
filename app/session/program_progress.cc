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
  if (shares.feed != shares_.feed) faster_s_ = faster_plan_s_ = 0;
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

void ProgramProgress::learn(const CycleReport& report, PlanTime::Kind kind) {
  if (kind.rapid || !kind.feed || shares_.feed <= 1 || report.motion != MotionState::kMoving) return;
  faster_s_ += period_s_;
  faster_plan_s_ += period_s_ * report.override_now;
}

double ProgramProgress::left_s() const {
  if (!total_.known) return -1;
  OverrideShares driven = shares_;
  if (driven.feed > 1) driven.feed = (faster_plan_s_ + kTrust_s * driven.feed) / (faster_s_ + kTrust_s);
  const double left_s = (total_.time - done_).real_s(driven);
  return std::isfinite(left_s) ? std::max(0.0, left_s) : -1;
}

}  // namespace trn

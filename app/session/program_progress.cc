#include "app/session/program_progress.h"

#include <algorithm>
#include <cmath>

#include "core/motion.h"

namespace trn {

namespace {

constexpr double kTrust_s = 2;  // so long counts what is asked for beside what was driven
// Before a rapid move was driven with an override, for how long its rate is thought to fall: 1/s, and as how
// many moves that counts.
constexpr double kRateSlope = 6, kTrustRuns = 0.3;

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
  in_run_ = false;
}

void ProgramProgress::report(const CycleReport& report, const ProgramStep* step,
                             const OverrideShares& shares) {
  if (shares.feed != shares_.feed) feed_ = {};
  if (shares.rapid != shares_.rapid) {
    run_.whole = false;
    runs_saved_s_ = runs_ = 0;
  }
  shares_ = shares;
  if (report.motion == MotionState::kRest) {
    done_ = {};
    step_ = 0;
    other_lines_ = false;
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
  learn_rapid(report, kind.rapid);
  if (report.motion != MotionState::kMoving || !kind.feed || kind.rapid || kind.adaptive || kind.spindle)
    return;
  feed_.time_s += period_s_;
  feed_.plan_s += period_s_ * report.override_now;
}

void ProgramProgress::learn_rapid(const CycleReport& report, bool rapid) {
  if (rapid && !in_run_) run_ = {0, 0, true};
  if (rapid && report.motion != MotionState::kMoving) run_.whole = false;
  if (!rapid && in_run_ && run_.whole && shares_.rapid > 0) {
    runs_saved_s_ += run_.plan_s / shares_.rapid - run_.time_s;
    ++runs_;
  }
  in_run_ = rapid;
  run_.time_s += period_s_;
  run_.plan_s += period_s_ * report.override_now;
}

// Against the time of rapid moves at the override from their beginning to their end.
double ProgramProgress::saved_s(const PlanTime& left) const {
  const double share = shares_.rapid;
  if (share <= 0 || share >= 1) return 0;
  const double thought_s = (1 - share) * (1 - share) / (2 * share * kRateSlope);
  const double each_s = (kTrustRuns * thought_s + runs_saved_s_) / (kTrustRuns + runs_);
  return std::clamp(left.rapid_runs() * each_s, 0.0, left.rapid_s() * (1 / share - 1));
}

double ProgramProgress::left_s() const {
  if (!total_.known) return -1;
  OverrideShares driven = shares_;
  if (driven.feed > 0) driven.feed = feed_.rate(driven.feed);
  const PlanTime left = total_.time - done_;
  const double left_s = left.real_s(driven) - saved_s(left);
  return std::isfinite(left_s) ? std::max(0.0, left_s) : -1;
}

}  // namespace trn

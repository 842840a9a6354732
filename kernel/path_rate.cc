#include "kernel/path_rate.h"

#include <cmath>

#include "core/check.h"

namespace trn {

namespace {
constexpr int kRenewLeads = 8;      // between questions while nothing changes: for new stops in store
constexpr double kArrived = 1e-9;   // of the rate
constexpr int kNoticeLeads = 4;     // that an answer must be late to be told
constexpr int kPatienceLeads = 10;  // that answers may be late before a motion from rest waits for them
}  // namespace

PathRate::PathRate(RatePlans& plans, double period_s)
    : plans_(plans), follower_(period_s), lead_periods_(rate_lead_periods(period_s)) {}

double PathRate::start(MotionQueue& queue, double rate) TRN_RT {
  stale_ = true;
  has_stops_ = false;
  if (asked_ && --periods_left_ <= 0) take_answer();
  if (!asked_) queue.keep_nothing();
  if (stands_by() && rate > 0) notice_late();
  follower_.restart(stands_by() ? 0 : rate);
  return follower_.step();
}

void PathRate::rest(MotionQueue& queue) TRN_RT {
  stale_ = true;
  has_stops_ = false;
  if (asked_ && --periods_left_ <= 0) take_answer();
  if (asked_) return;
  queue.keep_nothing();
  const RatePlan& plan = follower_.plan();
  plans_.ask({{queue.front_number(), 0, 0}, {0, 0, plan.count, 0}, &plan, {0}, {}});
  asked_ = true;
  periods_left_ = lead_periods_;
}

void PathRate::stand_elsewhere() TRN_RT {
  stale_ = true;
  has_stops_ = steady_ = false;
  follower_.restart(0);
}

double PathRate::step(MotionQueue& queue, const PlanPlace& place, const RateWish& wish) TRN_RT {
  TRN_CHECK(wish.rate >= 0 && wish.rate <= 2);
  TRN_CHECK(wish.stop_in_s >= 0);
  ++since_answer_;
  const int stop = stop_that_begins(0);
  const bool holds = wish.rate == 0;
  // What was asked for may not be wished any more: only for a hold there is something better in store.
  if (stop >= 0 && holds && asked_rate_ > 0) begin_stop(stop);
  if (asked_ && --periods_left_ <= 0) take_answer();
  if (late() && stop >= 0 && has_stops_ && (holds || !has_later_stop(stop)) && begin_stop(stop) && !holds)
    notice_late();
  ++since_question_;
  const bool changed = wish.rate != asked_rate_ || wish.stop_in_s < RateWish::kNoStop;
  if (waits_for_stop(holds)) return follower_.step();
  if (!asked_ && (changed || !steady_ || since_question_ >= kRenewLeads * lead_periods_)) {
    asked_from_ = place.block;
    queue.keep_from(has_stops_ ? stops_from_ : asked_from_);
    plans_.ask({place, follower_.state(), &follower_.plan(), wish, queue.view()});
    asked_ = true;
    stale_ = false;
    periods_left_ = lead_periods_;
    asked_rate_ = wish.rate;
    since_question_ = 0;
    steady_ = false;
  }
  return follower_.step();
}

// An answer that is late would begin in the past: it is dropped when it comes.
void PathRate::take_answer() TRN_RT {
  const RatePlan* plan = nullptr;
  const bool came = stale_ ? plans_.forget() : plans_.take(plan);
  if (!came) {
    moved_ |= !stale_;
    if (++late_periods_ >= kNoticeLeads * lead_periods_ && moved_) notice_late();
    stale_ = true;
    return;
  }
  asked_ = false;
  late_periods_ = 0;
  moved_ = noticed_ = false;
  if (stale_) return;
  has_stops_ = true;
  stops_from_ = asked_from_;
  since_answer_ = 0;
  if (plan) follower_.adopt(*plan);
  const RateState& state = follower_.state();
  steady_ = !plan && state.plan_ended(follower_.plan()) && std::abs(state.rate - asked_rate_) <= kArrived &&
            has_later_stop(-1);
}

// Once for each answer.
void PathRate::notice_late() TRN_RT {
  if (!noticed_) ++late_answers_;
  noticed_ = true;
}

// The stop in store that begins so many periods from now; -1: none.
int PathRate::stop_that_begins(int periods) const TRN_RT {
  for (int i = 0; has_stops_ && i < kStopsInStore; ++i)
    if (since_answer_ + periods == (kStopLeads[static_cast<std::size_t>(i)] - 1) * lead_periods_) return i;
  return -1;
}

// A hold need not be asked for: before the answer a stop in store begins.
bool PathRate::waits_for_stop(bool holds) const TRN_RT {
  if (!holds || asked_ || asked_rate_ == 0) return false;
  for (int periods = 1; periods < lead_periods_; ++periods)
    if (stop_that_begins(periods) >= 0) return true;
  return false;
}

bool PathRate::has_later_stop(int index) TRN_RT {
  for (int i = index + 1; i < kStopsInStore; ++i)
    if (plans_.stop(i)) return true;
  return false;
}

bool PathRate::begin_stop(int index) TRN_RT {
  const RatePlan* stop = plans_.stop(index);
  if (!stop) return false;
  follower_.adopt(*stop);
  has_stops_ = false;
  stale_ = true;
  return true;
}

bool PathRate::stands_by() const TRN_RT { return late_periods_ > kPatienceLeads * lead_periods_; }

}  // namespace trn

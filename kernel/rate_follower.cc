#include "kernel/rate_follower.h"

#include <algorithm>

#include "core/check.h"

namespace trn {

void RateFollower::restart(double rate) TRN_RT {
  TRN_CHECK(rate >= 0);
  plan_.count = plan_.arrival = 0;
  plan_.end_rate = plan_.level_rate = std::min(rate, 1.0);
  plan_.stops = plan_.at_place = false;
  state_ = {plan_.end_rate, 0, 0, 0};
}

void RateFollower::adopt(const RatePlan& plan) TRN_RT {
  plan_.copy_from(plan);
  state_.next = 0;
  state_.spent_s = 0;
}

double RateFollower::step() TRN_RT {
  before_ = state_;
  return state_.follow(plan_, period_s_);
}

double RateFollower::plan_time_at(double part) const TRN_RT {
  RateState state = before_;
  return state.follow(plan_, part * period_s_);
}

}  // namespace trn

#pragma once

#include "core/axes.h"
#include "kernel/rate/rate_planner.h"
#include "kernel/rate_plan.h"
#include "kernel/rate_plans.h"

namespace trn {

/// Rate plans made in the caller's own thread, and only when they are taken: for runs without a clock.
class InlineRatePlans final : public RatePlans {
 public:
  InlineRatePlans(const Joints& joints, double period_s) : planner_(joints, period_s) {}

  void ask(const RateRequest& request) TRN_RT override { request_ = request; }
  bool take(const RatePlan*& plan) TRN_RT override {
    if (!late_) plan = planner_.plan(request_);
    return !late_;
  }
  bool forget() TRN_RT override { return !late_; }
  const RatePlan* stop(int index) TRN_RT override { return planner_.stop(index); }

  /// From now on answers do not come, or come again: as a session's log tells, or a test wants it.
  void set_late(bool late) { late_ = late; }

 private:
  RatePlanner planner_;
  RateRequest request_;
  bool late_ = false;
};

}  // namespace trn

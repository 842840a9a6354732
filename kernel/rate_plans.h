#pragma once

#include "core/realtime.h"
#include "kernel/rate_plan.h"

namespace trn {

/// Who makes the rate plans, beside the tick. One request at a time: ask, take its answer, ask again.
class RatePlans {
 public:
  virtual ~RatePlans() = default;

  /// Asks for a plan that begins one lead later. Never waits. What the request names stays as it is until its
  /// answer is taken: the plan in force, and the queue's blocks from its place on (MotionQueue::keep_from).
  virtual void ask(const RateRequest& request) TRN_RT = 0;
  /// True when the answer is there. `plan`: better than the one in force; null: there is none.
  virtual bool take(const RatePlan*& plan) TRN_RT = 0;
  /// Instead: the answer is not wanted. True when nothing of the request is looked at any more.
  virtual bool forget() TRN_RT = 0;
  /// A stop in store, of kStopLeads: a plan to rest that begins there if the last answer that was taken is
  /// followed until then; null: none was found.
  virtual const RatePlan* stop(int index) TRN_RT = 0;
};

}  // namespace trn

#include "kernel/rate_plan.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace trn {

namespace {

constexpr double kStopReserve = 2;  // plan time of a stop over the time of a joint's shortest stop
constexpr double kLeadS = 0.002;

// r = r0 + w0 t + u t^2 / 2, and plan time is its integral.
double pass(RateState& state, double u, double duration_s) TRN_RT {
  TRN_CHECK(duration_s >= 0);
  TRN_CHECK(std::isfinite(u));
  const double passed = duration_s * (state.rate + duration_s * (state.slope / 2 + duration_s * u / 6));
  state.rate += duration_s * (state.slope + duration_s * u / 2);
  state.slope += duration_s * u;
  return passed;
}

}  // namespace

int rate_lead_periods(double period_s) TRN_RT {
  return std::max(1, static_cast<int>(std::lround(kLeadS / period_s)));
}

double plan_stop_s(const Joints& joints) {
  double stop_s = 0;
  for (const Joint& joint : joints) {
    const JointLimit& limit = joint.limit;
    stop_s = std::max(stop_s, limit.velocity / limit.acceleration + limit.acceleration / limit.jerk);
  }
  return kStopReserve * stop_s;
}

double RatePlan::time_s(int from) const TRN_RT {
  double sum = 0;
  for (int i = from; i < count; ++i) sum += steps[static_cast<std::size_t>(i)].duration_s;
  return sum;
}

void RatePlan::copy_from(const RatePlan& other) TRN_RT {
  TRN_CHECK(other.count >= 0 && other.count <= kStepsMax);
  TRN_CHECK(other.arrival >= 0 && other.arrival <= other.count);
  std::copy_n(other.steps.begin(), other.count, steps.begin());
  count = other.count;
  arrival = other.arrival;
  target = other.target;
  end_rate = other.end_rate;
  level_rate = other.level_rate;
  stops = other.stops;
  at_place = other.at_place;
}

double RateState::follow(const RatePlan& plan, double time_s) TRN_RT {
  TRN_CHECK(time_s >= 0);
  TRN_CHECK(next >= 0 && next <= plan.count);
  double passed = 0;
  while (time_s > kNoTime_s && next < plan.count) {
    const RateStep& step = plan.steps[static_cast<std::size_t>(next)];
    const double dt = std::min(time_s, step.duration_s - spent_s);
    passed += pass(*this, step.u, dt);
    time_s -= dt;
    spent_s += dt;
    if (spent_s < step.duration_s - kNoTime_s) continue;
    ++next;
    spent_s = 0;
    if (next == plan.arrival) {  // exactly there: sums of steps end beside it by rounding
      rate = plan.target;
      slope = 0;
    }
    if (next == plan.count) {
      TRN_CHECK(plan.end_rate >= -kNoRate && plan.end_rate <= 2);
      rate = plan.end_rate;
      slope = 0;
    }
  }
  return time_s > kNoTime_s ? passed + pass(*this, 0, time_s) : passed;
}

}  // namespace trn

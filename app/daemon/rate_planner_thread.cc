#include "app/daemon/rate_planner_thread.h"

#include <pthread.h>

#include <algorithm>
#include <chrono>

#include "app/daemon/realtime.h"

namespace trn {

namespace {
constexpr auto kPoll = std::chrono::microseconds(500);
// Below the threads of interrupts, which a PREEMPT_RT kernel runs at 50: an answer may take a few
// milliseconds on a slow processor, and the frames of a field bus must not wait for it.
constexpr int kBelowInterrupts = 49;
}  // namespace

void RatePlannerThread::start(const RealtimeConfig& config) {
  TRN_CHECK(!thread_.joinable());
  RealtimeConfig below = config;
  below.priority = std::clamp(config.priority - 1, 0, kBelowInterrupts);
  below.cpu = -1;  // the tick's may be kept for it alone
  ends_ = false;
  thread_ = std::thread([this, below] {
    pthread_setname_np(pthread_self(), "rate planner");
    make_thread_realtime(below);  // what is refused here is refused to the tick too, which tells it
    run();
  });
}

void RatePlannerThread::stop_thread() {
  ends_ = true;
  if (thread_.joinable()) thread_.join();
}

void RatePlannerThread::run() {
  while (!ends_.load(std::memory_order_relaxed))
    if (!work()) std::this_thread::sleep_for(kPoll);
}

bool RatePlannerThread::work() {
  if (asked_.load(std::memory_order_acquire) == answered_.load(std::memory_order_relaxed)) return false;
  const std::uint64_t number = answered_.load(std::memory_order_relaxed) + 1;
  Answer& to = answers_[next_];
  to.failure = {};
  {
    const CheckScope checks(to.failure);
    const RatePlan* const plan = planner_.plan(request_);
    to.has_plan = plan != nullptr;
    if (plan) to.plan.copy_from(*plan);
    for (int i = 0; i < kStopsInStore; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const RatePlan* const stop = planner_.stop(i);
      to.has_stop[k] = stop != nullptr;
      if (stop) to.stops[k].copy_from(*stop);
    }
  }
  answered_.store(number, std::memory_order_release);
  return true;
}

void RatePlannerThread::ask(const RateRequest& request) TRN_RT {
  const std::uint64_t number = asked_.load(std::memory_order_relaxed);
  TRN_CHECK(answered_.load(std::memory_order_acquire) == number);
  request_ = request;
  in_force_.copy_from(*request.plan);  // it may change before it is looked at
  request_.plan = &in_force_;
  next_ = 1 - taken_;
  asked_.store(number + 1, std::memory_order_release);
}

bool RatePlannerThread::take(const RatePlan*& plan) TRN_RT {
  if (!forget()) return false;
  taken_ = next_;
  const Answer& answer = answers_[taken_];
  // As if the check had failed here: the tick latches the fault and stops.
  if (answer.failure) check_failed(answer.failure.file, answer.failure.line, answer.failure.condition);
  plan = answer.has_plan ? &answer.plan : nullptr;
  return true;
}

bool RatePlannerThread::forget() TRN_RT {
  return answered_.load(std::memory_order_acquire) == asked_.load(std::memory_order_relaxed);
}

const RatePlan* RatePlannerThread::stop(int index) TRN_RT {
  const auto k = static_cast<std::size_t>(index);
  TRN_CHECK(k < kStopLeads.size());
  const Answer& answer = answers_[taken_];
  return answer.has_stop[k] ? &answer.stops[k] : nullptr;
}

}  // namespace trn

#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <thread>

#include "app/session/realtime_config.h"
#include "core/axes.h"
#include "core/check.h"
#include "kernel/rate/rate_planner.h"
#include "kernel/rate_plan.h"
#include "kernel/rate_plans.h"

namespace trn {

/// Makes rate plans in a thread of its own, which looks for a question twice in a millisecond. Question and
/// answers lie in fixed memory; the tick makes no system call and waits for nothing.
class RatePlannerThread final : public RatePlans {
 public:
  RatePlannerThread(const Joints& joints, double period_s) : planner_(joints, period_s) {}
  ~RatePlannerThread() override { stop_thread(); }
  RatePlannerThread(const RatePlannerThread&) = delete;
  RatePlannerThread& operator=(const RatePlannerThread&) = delete;

  /// The thread begins, with a priority one below the tick's, on any processor.
  void start(const RealtimeConfig& config);
  /// It ends; answers no longer come.
  void stop_thread();
  /// What the thread does, for a caller without one: answers the question, if one is open.
  bool work();

  void ask(const RateRequest& request) TRN_RT override;
  bool take(const RatePlan*& plan) TRN_RT override;
  bool forget() TRN_RT override;
  const RatePlan* stop(int index) TRN_RT override;

 private:
  struct Answer {
    RatePlan plan;
    std::array<RatePlan, kStopsInStore> stops;
    bool has_plan = false;
    std::array<bool, kStopsInStore> has_stop{};
    CheckFailure failure;  ///< of a check while it was made
  };

  void run();

  RatePlanner planner_;
  // The tick writes these while no question is open, the thread reads them while one is.
  RateRequest request_;
  RatePlan in_force_;
  std::size_t next_ = 0;  ///< place of its answer
  /// While one is made, the stops of the last one that was taken stay in store.
  std::array<Answer, 2> answers_;
  std::atomic<std::uint64_t> asked_ = 0, answered_ = 0;  ///< numbers of the last question and answer
  std::size_t taken_ = 1;                                ///< the tick's own: place of the last answer it took
  std::atomic<bool> ends_ = false;
  std::thread thread_;
};

}  // namespace trn

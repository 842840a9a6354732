#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <utility>

#include "app/lab/tune/tune_data.h"
#include "app/lab/tune/tune_plan.h"
#include "app/session/assembly.h"
#include "kernel/rt_messages.h"

namespace trn {

/// Puts the reports of a joint's periods together: what it was told, beside what it did.
class TuneRecorder {
 public:
  /// `feedback_periods`: as the drives say.
  TuneRecorder(double period_s, int feedback_periods, int joint);
  /// What comes from now on is of this stroke.
  void begin(int stroke) { stroke_ = stroke; }
  /// Of every period, in order; std::runtime_error where one is missing. `stirred`: what the drive was told
  /// beside, N or Nm.
  void take(const CycleReport& report, double stirred = 0);
  const TuneData& data() const { return data_; }
  TuneData take_data() { return std::move(data_); }

 private:
  int joint_;
  std::size_t lag_;
  TuneData data_;
  std::deque<std::pair<double, double>> setpoints_;  ///< and what was told beside
  std::uint64_t last_period_ = 0;
  int stroke_ = -1;
};

/// Moves the joint of an emulated machine in this process by the plan, without feed-forward, and returns what
/// it did. `plan_of` makes the plan for where the joint stands. std::runtime_error where the machine does not
/// get ready or faults.
TuneData tune_emulated(Assembly& assembly, int joint, const std::function<TunePlan(double stands)>& plan_of);

}  // namespace trn

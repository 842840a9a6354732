#pragma once

#include <chrono>
#include <cstdint>

namespace trn {

/// Warns of a rate planner that answers late, once in ten seconds at most.
class LateRatePlans {
 public:
  /// `count`: CycleReport::late_rate_plans.
  void hear(std::uint32_t count, std::chrono::steady_clock::time_point now);

 private:
  std::uint32_t told_ = 0;
  std::chrono::steady_clock::time_point quiet_until_;
};

}  // namespace trn

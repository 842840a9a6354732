#include "app/daemon/late_rate_plans.h"

#include <spdlog/spdlog.h>

namespace trn {

void LateRatePlans::hear(std::uint32_t count, std::chrono::steady_clock::time_point now) {
  if (count == told_ || now < quiet_until_) return;
  spdlog::warn(
      "rate_plan_late: the rate planner did not answer in time ({} times so far). Overrides act later, and "
      "if "
      "it does not answer at all the motion stops on its path. Other work on this host has priority over it: "
      "see 'NOT REAL TIME' above, or give the daemon a processor of its own",
      count);
  told_ = count;
  quiet_until_ = now + std::chrono::seconds(10);
}

}  // namespace trn

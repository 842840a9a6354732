#include "kernel/overrides.h"

#include <algorithm>

#include "core/check.h"

namespace trn {

bool Overrides::obey(const RtCommand& command) TRN_RT {
  using Kind = RtCommand::Kind;
  const auto take = [&](double& factor, double most) {
    factor = std::clamp(command.value, 0.0, most);
    return true;
  };
  switch (command.kind) {
    case Kind::kOverride:
      return take(feed_, kMax);
    case Kind::kRapidOverride:
      return take(rapid_, 1.0);
    case Kind::kSpindleOverride:
      return take(spindle_, kMax);
    case Kind::kAdaptiveFeed:
      return take(adaptive_feed_, 1.0);
    default:
      return false;
  }
}

double Overrides::motion(const MotionBlock* block) const TRN_RT {
  TRN_CHECK(feed_ >= 0 && feed_ <= kMax);
  TRN_CHECK(rapid_ >= 0 && rapid_ <= 1 && adaptive_feed_ >= 0 && adaptive_feed_ <= 1);
  if (block && block->rapid) return rapid_;
  const OverrideMode mode = block ? block->overrides : OverrideMode{};
  const double by_spindle = mode.follows_spindle() ? spindle_ : 1.0;
  return std::min((mode.feed ? feed_ : 1.0) * (mode.adaptive ? adaptive_feed_ : 1.0) * by_spindle, kMax);
}

}  // namespace trn

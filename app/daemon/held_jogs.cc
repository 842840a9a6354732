#include "app/daemon/held_jogs.h"

#include <algorithm>

#include "core/check.h"

namespace trn {

void HeldJogs::hear(int joint, std::chrono::milliseconds alive, Time now) {
  TRN_CHECK(joint >= 0 && joint <= kDirection);
  until_[static_cast<std::size_t>(joint)] = alive.count() > 0 ? now + alive : Time::max();
}

std::optional<int> HeldJogs::take_silent(Time now) {
  const auto silent = std::find_if(until_.begin(), until_.end(), [&](Time until) { return until <= now; });
  if (silent == until_.end()) return std::nullopt;
  *silent = Time::max();
  return static_cast<int>(silent - until_.begin());
}

}  // namespace trn

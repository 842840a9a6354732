#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace trn {

/// The whole periods in which a time is over. More than fit are as many as fit: at 1 kHz seven weeks.
inline std::uint32_t periods_of(double duration_s, double period_s) {
  constexpr double kMost = std::numeric_limits<std::uint32_t>::max();
  // The 1e-9 keeps 0.05 / 0.001, which is 50 and a rounding error, from becoming 51.
  return static_cast<std::uint32_t>(std::clamp(std::ceil(duration_s / period_s - 1e-9), 0.0, kMost));
}

}  // namespace trn

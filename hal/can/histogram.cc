#include "hal/can/histogram.h"

#include <algorithm>
#include <cmath>

namespace trn {

void TimeHistogram::add(std::int64_t duration_ns) TRN_RT {
  const double us = static_cast<double>(std::max<std::int64_t>(duration_ns, 0)) / 1000;
  const int bucket = us < 1 ? 0 : std::min(kBuckets - 1, 1 + static_cast<int>(4 * std::log2(us)));
  counts_[static_cast<std::size_t>(bucket)].fetch_add(1, std::memory_order_relaxed);
  if (duration_ns > max_ns_.load(std::memory_order_relaxed))
    max_ns_.store(duration_ns, std::memory_order_relaxed);
}

std::uint64_t TimeHistogram::count() const {
  std::uint64_t sum = 0;
  for (const auto& count : counts_) sum += count.load(std::memory_order_relaxed);
  return sum;
}

double TimeHistogram::percentile_us(double share) const {
  const std::uint64_t all = count();
  if (all == 0) return 0;
  const double wanted = share * static_cast<double>(all);
  std::uint64_t sum = 0;
  for (int i = 0; i < kBuckets; ++i) {
    sum += counts_[static_cast<std::size_t>(i)].load(std::memory_order_relaxed);
    if (static_cast<double>(sum) >= wanted) return std::min(std::exp2(i / 4.0), max_us());
  }
  return max_us();
}

}  // namespace trn

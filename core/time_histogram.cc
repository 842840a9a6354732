#include "core/time_histogram.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace trn {

// Bucket 4 o + f holds durations from 2^o (1 + f/4) us on; bucket 0 also all below.
void TimeHistogram::add(std::int64_t duration_ns) TRN_RT {
  // In quarters of a microsecond the three leading bits are what counts: the place of the first is the
  // octave, the other two the quarter in it.
  const auto quarters = static_cast<std::uint64_t>(std::max<std::int64_t>(duration_ns, 1000)) * 4 / 1000;
  const int octave = static_cast<int>(std::bit_width(quarters)) - 3;
  const int bucket = std::min(4 * octave + static_cast<int>(quarters >> octave) - 4, kBuckets - 1);
  counts_[static_cast<std::size_t>(bucket)].fetch_add(1, std::memory_order_relaxed);
  // No exchange is needed: only one thread adds.
  if (duration_ns > max_ns_.load(std::memory_order_relaxed))
    max_ns_.store(duration_ns, std::memory_order_relaxed);
}

double TimeHistogram::percentile_us(double share) const {
  std::uint64_t total = 0;
  for (const auto& count : counts_) total += count.load(std::memory_order_relaxed);
  const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(total)));
  std::uint64_t seen = 0;
  for (int bucket = 0; bucket < kBuckets && total > 0; ++bucket) {
    seen += counts_[static_cast<std::size_t>(bucket)].load(std::memory_order_relaxed);
    if (seen >= wanted) return std::min(max_us(), edge_us(bucket));
  }
  return 0;
}

double TimeHistogram::edge_us(int bucket) { return std::ldexp(1 + (bucket % 4 + 1) / 4.0, bucket / 4); }

std::vector<TimeHistogram::Bucket> TimeHistogram::buckets() const {
  std::vector<Bucket> out;
  for (int bucket = 0; bucket < kBuckets; ++bucket) {
    const std::uint32_t count = counts_[static_cast<std::size_t>(bucket)].load(std::memory_order_relaxed);
    if (count > 0 || !out.empty()) out.push_back({edge_us(bucket), count});
  }
  while (!out.empty() && out.back().count == 0) out.pop_back();
  return out;
}

}  // namespace trn

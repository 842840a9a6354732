#pragma once

#include <cmath>
#include <cstdint>

#include "core/realtime.h"

namespace trn {

/// Seeded noise without state of the library: the same numbers on every machine. SplitMix64 (Steele, Lea and
/// Flood, 2014); Gaussian values as the sum of twelve uniform ones (kurtosis 2.9, bounded by 6).
class NoiseSource {
 public:
  explicit NoiseSource(std::uint64_t seed) : state_(seed) {}

  /// In [0, 1).
  double uniform() TRN_RT { return static_cast<double>(next() >> 11) * 0x1.0p-53; }
  double uniform(double from, double to) TRN_RT { return from + (to - from) * uniform(); }
  /// Mean 0, variance 1.
  double gaussian() TRN_RT {
    double sum = -6;
    for (int i = 0; i < 3; ++i) {
      const std::uint64_t bits = next();
      for (int part = 0; part < 4; ++part)
        sum += static_cast<double>(bits >> (16 * part) & 0xffffu) * 0x1.0p-16;
    }
    return sum;
  }

 private:
  std::uint64_t next() TRN_RT {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  std::uint64_t state_;
};

/// Nearest multiple of `step`.
inline double quantised(double value, double step) TRN_RT { return step * std::nearbyint(value / step); }

}  // namespace trn

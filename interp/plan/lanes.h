#pragma once

#include <cstddef>
#include <cstring>
#include <vector>

/// Compiled for the vector units there are, chosen when the program starts; contraction stays off, so that
/// the results are the same bits.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(__x86_64__)
#define TRN_VECTOR_CLONES
#else
#define TRN_VECTOR_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#endif
#define TRN_VECTOR_INLINE inline __attribute__((always_inline))

namespace trn {

using Doubles = std::vector<double>;

/// Four neighbouring places, computed at once: as many as every vector unit takes. Of comparisons of longer
/// vectors than its own the compiler makes one for each lane. One result on every processor: only lane-wise
/// operations.
constexpr size_t kLanes = 4;
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float)), aligned(kLanes * sizeof(float))));
/// The same with the digits that differences of neighbouring places need.
using Wide = double __attribute__((vector_size(kLanes * sizeof(double)), aligned(kLanes * sizeof(double))));
/// Eight motor joints, computed at once.
using Eight = double __attribute__((vector_size(8 * sizeof(double)), aligned(64)));

/// Groups of lanes that hold `count` places.
constexpr size_t lane_groups(size_t count) { return (count + kLanes - 1) / kLanes; }

TRN_VECTOR_INLINE void raise(Lanes& to, const Lanes& by) { to = by > to ? by : to; }

TRN_VECTOR_INLINE float largest(const Lanes& v) {
  float out = v[0];
  for (size_t i = 1; i < kLanes; ++i) out = v[i] > out ? v[i] : out;
  return out;
}

}  // namespace trn

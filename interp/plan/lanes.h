#pragma once

#include <cstddef>
#include <cstring>
#include <vector>

/// A function with this mark is compiled once for each kind of vector unit, and the one for this processor is
/// chosen when the program starts. Contraction of products and sums stays off, so all of them give the same
/// bits. Sanitizers cannot follow the choice. clang calls such a function by another name than gcc does,
/// which a file that sees only its declaration does not know; it compiles the fuzz targets.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || defined(__clang__) || \
    !defined(__x86_64__)
#define TRN_VECTOR_CLONES
#else
#define TRN_VECTOR_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#endif
#define TRN_VECTOR_INLINE inline __attribute__((always_inline))

namespace trn {

using Doubles = std::vector<double>;

/// Four neighbouring samples, computed at once. Four is the width that every vector unit has: where vectors
/// are longer than the unit's own, the compiler turns each comparison into one scalar comparison a lane,
/// which is slow. Only lane-wise operations are used, so the result is the same on every processor.
constexpr size_t kLanes = 4;
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float)), aligned(kLanes * sizeof(float))));
/// The same in double precision, for differences of neighbouring samples, in which digits cancel.
using Wide = double __attribute__((vector_size(kLanes * sizeof(double)), aligned(kLanes * sizeof(double))));
/// Eight motor joints, computed at once.
using Eight = double __attribute__((vector_size(8 * sizeof(double)), aligned(64)));

/// Groups of lanes that hold `count` samples.
constexpr size_t lane_groups(size_t count) { return (count + kLanes - 1) / kLanes; }

/// Each lane of `to` becomes the greater of its own value and that of `by`.
TRN_VECTOR_INLINE void raise(Lanes& to, const Lanes& by) { to = by > to ? by : to; }

TRN_VECTOR_INLINE float largest(const Lanes& v) {
  float out = v[0];
  for (size_t i = 1; i < kLanes; ++i) out = v[i] > out ? v[i] : out;
  return out;
}

}  // namespace trn

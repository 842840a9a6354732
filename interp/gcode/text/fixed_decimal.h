#pragma once

namespace trn {

/// Bytes that write_four_decimals writes at the most.
inline constexpr int kFourDecimalsMax = 24;

/// Writes `value` as fmt's {:.4f} does, correctly rounded, and returns the place behind it. Returns null
/// without writing anything for a magnitude of 1e11 or more, for what is no number, and for a value that lies
/// exactly between two results.
char* write_four_decimals(char* to, double value);

}  // namespace trn

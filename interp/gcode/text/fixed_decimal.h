#pragma once

namespace trn {

/// Bytes that write_four_decimals writes at the most.
inline constexpr int kFourDecimalsMax = 24;

/// Writes `value` as fmt's {:.4f} does, correctly rounded, and returns the place behind it; null, and nothing
/// that counts is written, for a value of 1e11 or more, for no number, and for one exactly between two
/// decimals.
char* write_four_decimals(char* to, double value);

}  // namespace trn

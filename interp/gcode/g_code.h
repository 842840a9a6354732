#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace trn {

/// A G code. In the source it is written as in a program: `1_g`, `38.2_g`. It is held as its number times
/// ten, which is also the number that #<_motion_mode> and its kind publish (LinuxCNC's predefined
/// parameters). No bare number is a code: `g_from_tenths` and `tenths` convert. Codes compare by their
/// number, and `kNoGCode` is below all.
enum class GCode : std::int32_t {};

/// The line, or the group, has no code.
inline constexpr GCode kNoGCode{-1};

/// The code whose number times ten is `number` (382: G38.2).
constexpr GCode g_from_tenths(int number) { return GCode{number}; }
/// The code's number times ten (G38.2: 382); -1 for `kNoGCode`.
constexpr int tenths(GCode code) { return static_cast<int>(code); }

consteval GCode operator""_g(unsigned long long number) {
  if (number > 999) throw "G codes end at G999";
  return GCode{static_cast<std::int32_t>(10 * number)};
}
consteval GCode operator""_g(long double number) {
  const auto code = static_cast<std::int32_t>(10 * number + 0.5L);
  const long double off = 10 * number - code;
  if (number > 999.9L || off > 1e-6L || off < -1e-6L) throw "a G code has at most one decimal";
  return GCode{code};
}

/// Codes of the work offsets 1 to 9, in this order.
inline constexpr std::array<GCode, 9> kWorkOffsetCodes = {54_g, 55_g,   56_g,   57_g,  58_g,
                                                          59_g, 59.1_g, 59.2_g, 59.3_g};

/// The code for people: "G38.2", "G1".
std::string g_name(GCode code);

}  // namespace trn

#include "interp/gcode/text/fixed_decimal.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "core/check.h"

namespace trn {

namespace {

constexpr double kLimit = 1e11;  // the scaled value is below 2^53 then
constexpr double kScale = 1e4;
constexpr double kRelativeError = 0x1p-52;  // of the scaled value, twice what one rounding makes

// "00" to "99" in a row.
constexpr std::array<char, 200> make_pairs() {
  std::array<char, 200> pairs{};
  for (std::size_t i = 0; i < 100; ++i) {
    pairs[2 * i] = static_cast<char>('0' + i / 10);
    pairs[2 * i + 1] = static_cast<char>('0' + i % 10);
  }
  return pairs;
}
constexpr std::array<char, 200> kPairs = make_pairs();

char* write_pair(char* to, std::uint64_t pair) {
  std::memcpy(to, &kPairs[2 * pair], 2);
  return to + 2;
}

char* write_whole(char* to, std::uint64_t number) {
  std::array<char, 20> digits;
  char* const end = digits.data() + digits.size();
  char* first = end;
  // Two digits at a time: half as many divisions, which are what writing a number costs.
  for (; number >= 100; number /= 100) write_pair(first -= 2, number % 100);
  if (number >= 10)
    write_pair(first -= 2, number);
  else
    *--first = static_cast<char>('0' + number);
  const auto count = static_cast<std::size_t>(end - first);
  TRN_CHECK(count >= 1 && count <= digits.size());
  std::memcpy(to, first, count);
  return to + count;
}

}  // namespace

// The scaled value is rounded once; unless that leaves it next to a half, the side it lies on is certain.
// Next to one, the remainder of the product tells.
char* write_four_decimals(char* to, double value) {
  const double magnitude = std::fabs(value);
  if (!(magnitude < kLimit)) return nullptr;
  const double scaled = magnitude * kScale;
  auto number = static_cast<std::int64_t>(scaled);
  // How far the scaled value lies above the half between two results.
  const double over = scaled - static_cast<double>(number) - 0.5;
  if (std::fabs(over) > scaled * kRelativeError) {
    number += over > 0;
  } else {
    // The fused multiplication gives what the rounding of the product has taken away.
    const double beyond_half = over + std::fma(magnitude, kScale, -scaled);
    // Exactly a half: the caller's slow way rounds it as the standard library does.
    if (beyond_half == 0) return nullptr;
    number += beyond_half > 0;
  }
  if (std::signbit(value)) *to++ = '-';
  const auto digits = static_cast<std::uint64_t>(number);
  to = write_whole(to, digits / 10000);
  *to++ = '.';
  to = write_pair(to, digits / 100 % 100);
  return write_pair(to, digits % 100);
}

}  // namespace trn

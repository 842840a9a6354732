#pragma once

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "core/sanitizer.h"

namespace trn::test {

/// What TRN_LONG wishes for, as `TRN_LONG=10000 ctest`; nothing in the short form.
inline std::optional<long> long_form() {
  const char* wish = std::getenv("TRN_LONG");
  return wish ? std::optional(std::atol(wish)) : std::nullopt;
}

/// How many rounds of the short form a build has time for: an eighth with a sanitizer, where a round takes
/// ten to thirty times as long. A sanitizer looks at which code runs, and the release at the numbers.
constexpr int brief(int rounds) { return kSanitized ? std::max(1, rounds / 8) : rounds; }

/// How many rounds a proof has: `short_form`, or in the long form TRN_LONG / `share` if that is more.
inline int rounds(int short_form, int share = 1) {
  const std::optional<long> wish = long_form();
  return wish ? std::max(short_form, static_cast<int>(*wish / share)) : brief(short_form);
}

}  // namespace trn::test

#pragma once

#include <cstddef>

namespace trn {

/// Calls of malloc, calloc, realloc and aligned allocation since the program began; -1 where it cannot be
/// counted (under a sanitizer).
long allocation_count();

}  // namespace trn

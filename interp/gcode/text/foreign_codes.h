#pragma once

#include <cstdint>

#include "interp/gcode/g_code.h"

namespace trn {

/// Refuses a code that is none of this control's; if it is a well-known one of another control, with what to
/// write here. BlockError.
[[noreturn]] void refuse_unknown_g(GCode code, std::uint32_t column);
[[noreturn]] void refuse_unknown_m(int code, std::uint32_t column);

}  // namespace trn

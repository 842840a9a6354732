#include "interp/gcode/g_code.h"

#include <fmt/format.h>

namespace trn {

std::string g_name(GCode code) {
  const int whole = tenths(code) / 10, tenth = tenths(code) % 10;
  return tenth == 0 ? fmt::format("G{}", whole) : fmt::format("G{}.{}", whole, tenth);
}

}  // namespace trn

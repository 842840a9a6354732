#pragma once

#include "app/session/assembly.h"
#include "core/ports.h"

namespace trn {

/// Bit i: word i moves from a program's first line on. The axis of a spindle is a spindle then.
inline unsigned program_words(const Assembly& assembly) {
  const unsigned mask = assembly.kinematics->word_mask();
  const int spindle = assembly.program.spindle_axis.axis;
  return spindle < 0 ? mask : mask & ~(1U << spindle);
}

}  // namespace trn

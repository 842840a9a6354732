#pragma once

#include <fstream>
#include <iterator>
#include <string>

#include "core/axes.h"
#include "core/units.h"

namespace trn {

/// mm or degrees of a joint, in its own unit.
inline double unit_of_joint(const Joint& joint) { return joint.kind == JointKind::kRotary ? kRadPerDeg : 1; }
inline const char* unit_name_of(const Joint& joint) {
  return joint.kind == JointKind::kRotary ? "deg" : "mm";
}

/// "" if it cannot be read.
inline std::string text_of_file(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace trn

#pragma once

#include <string>
#include <vector>

#include "compensation/fit/joint_table_fit.h"

namespace trn {

/// One joint's errors and what was fitted to them, for a picture.
struct ErrorCurve {
  std::string joint, unit;  ///< unit: of all its lengths or angles, mm or deg
  const std::vector<AxisMeasurement>* measured = nullptr;
  JointTableFit fit;
  const std::vector<AxisMeasurement>* after = nullptr;  ///< with correction; may be null
};

/// Error over place, one diagram a joint (SVG).
std::string error_curves(const std::vector<ErrorCurve>& curves);

}  // namespace trn

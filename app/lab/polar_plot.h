#pragma once

#include <string>
#include <vector>

#include "compensation/fit/ballbar.h"

namespace trn {

/// One trace of a ball-bar picture.
struct PolarCurve {
  const BallbarTrace* trace;
  std::string label;
};

/// A picture in the manner of ball-bar reports (SVG): deviations of the bar's length, um, around a circle,
/// over the angle of the test.
std::string polar_plot(const std::string& title, const std::vector<PolarCurve>& curves);

}  // namespace trn

#pragma once

#include <vector>

namespace trn {

/// One point of a there-and-back measurement of an axis: where it was told to go, where it went (mm or rad).
struct AxisMeasurement {
  double commanded = 0, actual = 0;
};

/// What the measurements of one joint say.
struct JointTableFit {
  double slope = 0, slope_deviation = 0;        ///< for the config: commanded * (1 + slope) goes right
  double backlash = 0, backlash_deviation = 0;  ///< backward less forward
  double datum = 0;                             ///< error at zero, mean of both directions; not corrected
  double rms = 0;                               ///< of what the line leaves
  std::vector<double> at, forward, backward;    ///< the table: actual less commanded, less the datum
  std::vector<int> direction;                   ///< of each measurement: +1 reached forward, -1 backward
};

/// Least squares of actual - commanded = datum + s commanded -+ backlash / 2; slope = 1 / (1 + s) - 1. With
/// `places` > 1 also a table of that many equally spaced places (piecewise linear, each direction on its
/// own). The order of the measurements tells the direction. std::invalid_argument when they say too little.
JointTableFit fit_joint_table(const std::vector<AxisMeasurement>& measurements, int places);

}  // namespace trn

#pragma once

#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "compensation/fit/joint_table_fit.h"
#include "compensation/joint_tables.h"

namespace trn {

/// A there-and-back measurement along one axis word, with scales that read every joint where it stands.
struct JointMeasureConfig {
  int word = kX;            ///< kX .. kC
  double from = 0, to = 0;  ///< mm or rad
  int places = 25;          ///< from one end to the other
  int passes = 2;           ///< there and back
  double noise = 0;         ///< standard deviation of a reading, mm or rad of the joint
  double resolution = 0;    ///< of the scale; 0: none
  unsigned seed = 1;
};

/// Measurements by joint, in the order in which they were taken; none of a joint that stood still.
using JointMeasurements = std::vector<std::vector<AxisMeasurement>>;

/// The widest way of `word`, about where the machine stands, that keeps every joint in its range: from, to.
std::pair<double, double> word_range(Assembly& assembly, int word);

/// Drives the program of a measurement through the whole kernel on a simulated machine whose joints go wrong
/// as `truth` says. `corrected`: with the config's joint tables at work, else without. `program_path` is
/// where the program lies. std::runtime_error if it cannot be run.
JointMeasurements measure_joints(Assembly& assembly, const std::vector<JointTable>& truth,
                                 const JointMeasureConfig& config, bool corrected,
                                 const std::string& program_path);

/// Greatest error, actual less commanded, about its mean.
double error_amplitude(const std::vector<AxisMeasurement>& measured);

}  // namespace trn

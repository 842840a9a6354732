#pragma once

#include <vector>

namespace trn {

/// A line through (position, force) of a pressing test.
struct StiffnessFit {
  double stiffness_N_mm = 0;
  double sigma_N_mm = 0;  ///< standard error of it
  double rms_N = 0;       ///< of what the line leaves
  double contact_mm = 0;  ///< where the line has no force
};

/// Least squares; at least three samples with different positions, else std::invalid_argument.
StiffnessFit fit_stiffness(const std::vector<double>& position_mm, const std::vector<double>& force_N);

}  // namespace trn

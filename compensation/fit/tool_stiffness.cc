#include "compensation/fit/tool_stiffness.h"

#include <Eigen/Dense>
#include <cmath>
#include <stdexcept>

namespace trn {

StiffnessFit fit_stiffness(const std::vector<double>& position_mm, const std::vector<double>& force_N) {
  const auto n = static_cast<Eigen::Index>(position_mm.size());
  if (n < 3 || force_N.size() != position_mm.size())
    throw std::invalid_argument("a stiffness needs three samples of position and force at least");
  const Eigen::Map<const Eigen::ArrayXd> x(position_mm.data(), n), f(force_N.data(), n);
  if (!x.allFinite() || !f.allFinite())
    throw std::invalid_argument("a sample of position or force is not a finite number");
  // About the mean, slope and height of a line do not depend on each other, and large coordinates with a
  // small spread keep their digits.
  const Eigen::ArrayXd dx = x - x.mean();
  const double spread = dx.square().sum();
  if (spread <= 0) throw std::invalid_argument("a stiffness needs samples at different positions");
  StiffnessFit fit;
  fit.stiffness_N_mm = (dx * f).sum() / spread;
  fit.contact_mm = x.mean() - f.mean() / fit.stiffness_N_mm;
  const Eigen::ArrayXd left = f - f.mean() - fit.stiffness_N_mm * dx;
  fit.rms_N = std::sqrt(left.square().mean());
  // Two of the samples' freedoms went into slope and height.
  fit.sigma_N_mm = std::sqrt(left.square().sum() / static_cast<double>(n - 2) / spread);
  return fit;
}

}  // namespace trn

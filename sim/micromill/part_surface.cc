#include "sim/micromill/part_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/units.h"

namespace trn {

namespace {
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kBehindRad = 0.12;  // the tool's own half width on the smallest part, and some more
}  // namespace

PartSurface::PartSurface(const Config& config)
    : config_(config),
      nearest_(static_cast<std::size_t>(config.bins), kInfinity),
      farthest_(static_cast<std::size_t>(config.bins), -kInfinity),
      settled_nearest_(nearest_),
      settled_farthest_(farthest_) {}

double PartSurface::distance_mm(const Eigen::Vector2d& p_mm) const TRN_RT {
  const Eigen::Vector2d d = p_mm - config_.middle_mm;
  // The distance of a square is that of the square through the point, so its sides are places of equal
  // distance.
  return config_.shape == Shape::kRound ? d.norm() : d.cwiseAbs().maxCoeff();
}

int PartSurface::bin_of(const Eigen::Vector2d& p_mm) const TRN_RT {
  const Eigen::Vector2d d = p_mm - config_.middle_mm;
  const double turn = std::atan2(d.y(), d.x()) / (2 * kPi);
  const int bin = static_cast<int>((turn < 0 ? turn + 1 : turn) * config_.bins);
  return std::clamp(bin, 0, config_.bins - 1);
}

bool PartSurface::cut(const Eigen::Vector2d& p_mm) TRN_RT {
  const auto bin = static_cast<std::size_t>(bin_of(p_mm));
  const double distance = distance_mm(p_mm);
  if (distance >= settled_nearest_[bin] && distance <= settled_farthest_[bin]) return false;
  nearest_[bin] = std::min(nearest_[bin], distance);
  farthest_[bin] = std::max(farthest_[bin], distance);
  return true;
}

void PartSurface::settle(const Eigen::Vector2d& centre_mm) TRN_RT {
  const int bins = config_.bins, at = bin_of(centre_mm);
  if (settled_to_ < 0) settled_to_ = at;
  // What lies so far behind the tool cannot be touched by it any more and counts as surface for the next
  // turn.
  const int behind = static_cast<int>(kBehindRad / (2 * kPi) * bins);
  int ahead = (at - settled_to_ + bins) % bins;  // 0 .. bins; more than half a turn means backwards
  const int step = ahead <= bins / 2 ? 1 : -1;
  if (step < 0) ahead = bins - ahead;
  for (int left = std::min(ahead - behind, bins); left > 0; --left) {
    const auto bin = static_cast<std::size_t>(settled_to_);
    settled_nearest_[bin] = nearest_[bin];
    settled_farthest_[bin] = farthest_[bin];
    settled_to_ = (settled_to_ + step + bins) % bins;
  }
}

double PartSurface::diameter_mm() const {
  double sum = 0;
  int count = 0;
  for (int i = 0; i < config_.bins; ++i) {
    // Around the place where the tool comes in and leaves it marks the part; the measurement leaves that out.
    if (std::abs(2 * kPi * (i + 0.5) / config_.bins - kPi) < kMarkRad) continue;
    sum += nearest_[static_cast<std::size_t>(i)];
    ++count;
  }
  return std::isfinite(sum) ? 2 * sum / count : std::numeric_limits<double>::quiet_NaN();
}

double PartSurface::side_mean(int axis, bool plus) const {
  const double reach = std::atan(kSideShare);
  const double middle = (axis == 0 ? 0 : kPi / 2) + (plus ? 0 : kPi);
  double sum = 0;
  int count = 0;
  for (int i = 0; i < config_.bins; ++i) {
    const double angle = 2 * kPi * (i + 0.5) / config_.bins;
    if (std::abs(std::remainder(angle - middle, 2 * kPi)) > reach) continue;
    sum += nearest_[static_cast<std::size_t>(i)];
    ++count;
  }
  return sum / count;
}

double PartSurface::width_mm(int axis) const {
  const double width = side_mean(axis, true) + side_mean(axis, false);
  return std::isfinite(width) ? width : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace trn

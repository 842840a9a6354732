#include "sim/micromill/milling_cutter.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/units.h"

namespace trn {

using Eigen::Vector2d;

MillingCutter::MillingCutter(const Config& config) : config_(config) {
  for (int tooth = 0; tooth < kTeeth; ++tooth)
    tooth_radius_mm_[static_cast<std::size_t>(tooth)] =
        config.radius_mm + config.runout_mm * std::cos(config.runout_angle_rad + 2 * kPi * tooth / kTeeth);
  TRN_CHECK(config.radius_mm > 0);
  helix_lag_rad_mm_ = std::tan(config.helix_rad) / config.radius_mm;
  // The chip of a tooth is what the one before it has left, so the centre's way of a whole turn of the
  // spindle is kept.
  steps_per_tooth_ = 2 * kPi / (kTeeth * config.spindle_rad_s * config.step_s);
  centres_.assign(static_cast<std::size_t>(std::ceil(kTeeth * steps_per_tooth_)) + 2, Vector2d::Zero());
}

Vector2d MillingCutter::centre_before(int teeth) const TRN_RT {
  // The time from tooth to tooth is no whole number of steps, so the centre is interpolated between two of
  // them.
  const double lag = teeth * steps_per_tooth_;
  const auto whole = static_cast<std::size_t>(lag);
  const double part = lag - static_cast<double>(whole);
  const std::size_t n = centres_.size();
  const Vector2d& later = centres_[(newest_ + n - whole) % n];
  const Vector2d& earlier = centres_[(newest_ + 2 * n - whole - 1) % n];
  return later + part * (earlier - later);
}

Vector2d MillingCutter::tooth_force(int tooth, int slice, const Vector2d& centre, double edge_mm,
                                    PartSurface& part) TRN_RT {
  const double lag = (slice + 0.5) * edge_mm * helix_lag_rad_mm_;
  const double angle = angle_rad_ - 2 * kPi * tooth / kTeeth + lag;  // the spindle turns clockwise
  const Vector2d out(std::cos(angle), std::sin(angle));
  const double radius = tooth_radius_mm_[static_cast<std::size_t>(tooth)];
  double chip = std::numeric_limits<double>::infinity();
  // With run-out a tooth may miss the work altogether, and the next one cuts for both. So the thinnest chip
  // over all teeth of the last turn is what is left to cut.
  for (int before = 1; before <= kTeeth; ++before) {
    const auto leader = static_cast<std::size_t>((tooth + kTeeth - before % kTeeth) % kTeeth);
    chip = std::min(
        chip, radius - tooth_radius_mm_[leader] + advance_[static_cast<std::size_t>(before - 1)].dot(out));
  }
  if (chip <= 0) return Vector2d::Zero();
  const Vector2d tip = centre + radius * out;
  if (!part.cut(tip)) return Vector2d::Zero();
  // The edge's own force does not begin at once: a chip thinner than the ramp is partly pushed aside.
  const double engaged = std::min(1.0, chip / config_.edge_ramp_mm);
  const double tangential =
      edge_mm * (config_.tangential_N_mm2 * chip + config_.edge_tangential_N_mm * engaged);
  const double radial = edge_mm * (config_.radial_N_mm2 * chip + config_.edge_radial_N_mm * engaged);
  const Vector2d motion(out.y(), -out.x());
  return -radial * out - tangential * motion;
}

Vector2d MillingCutter::step(const Vector2d& holder_mm, double depth_mm, PartSurface& part) TRN_RT {
  const Vector2d centre = holder_mm + deflection_mm_;
  // On entry no tooth has left a surface yet. The first chip counts from where the tool stands.
  if (depth_mm > 0 && !cutting_) std::fill(centres_.begin(), centres_.end(), centre);
  cutting_ = depth_mm > 0;
  newest_ = (newest_ + 1) % centres_.size();
  centres_[newest_] = centre;
  angle_rad_ = std::remainder(angle_rad_ - config_.spindle_rad_s * config_.step_s, 2 * kPi);
  Vector2d force = Vector2d::Zero();
  if (cutting_) {
    const double edge_mm = depth_mm / kSlices;
    for (int before = 1; before <= kTeeth; ++before)
      advance_[static_cast<std::size_t>(before - 1)] = centre - centre_before(before);
    for (int tooth = 0; tooth < kTeeth; ++tooth)
      for (int slice = 0; slice < kSlices; ++slice) force += tooth_force(tooth, slice, centre, edge_mm, part);
    part.settle(centre);
  }
  // The tool takes its bend with a lag of its own. Without one, force and deflection would have to be solved
  // together in every step.
  deflection_mm_ += config_.step_s / config_.relaxation_s * (bent_by(force) - deflection_mm_);
  return force;
}

}  // namespace trn

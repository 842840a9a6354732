#pragma once

#include <Eigen/Dense>
#include <array>
#include <vector>

#include "core/realtime.h"
#include "sim/micromill/part_surface.h"

namespace trn {

/// A slender end mill that cuts and bends. Mechanistic force (Altintas, Manufacturing Automation, 2.7): chip
/// thickness against what the earlier teeth left, plus edge forces, summed over slices of the helix; the
/// teeth run out of true. The tool bends against the force with one relaxation time. Plane of the table; mm,
/// s, N.
class MillingCutter {
 public:
  static constexpr int kTeeth = 2, kSlices = 3;

  struct Config {
    double radius_mm = 0.5;
    double spindle_rad_s = 1884.955592153876;  ///< 18000 rpm
    double helix_rad = 0.5236;
    double runout_mm = 0.002, runout_angle_rad = 0;
    double tangential_N_mm2 = 2500, radial_N_mm2 = 1000;      ///< times chip area
    double edge_tangential_N_mm = 50, edge_radial_N_mm = 40;  ///< times engaged edge
    double edge_ramp_mm = 0.001;                              ///< chip thickness at which the edge is engaged
    Eigen::Vector2d stiffness_N_mm{50, 50};                   ///< of the tool's tip, along x and y
    double relaxation_s = 0.0004;
    double step_s = 1.0 / 48000;
  };

  explicit MillingCutter(const Config& config);

  /// One step: tool held at `holder_mm` (over the work), edges `depth_mm` deep (0 or less: in the air).
  /// Returns the force on the tool, N.
  Eigen::Vector2d step(const Eigen::Vector2d& holder_mm, double depth_mm, PartSurface& part) TRN_RT;

  /// The bending that makes `force_N` of a steady load.
  Eigen::Vector2d bent_by(const Eigen::Vector2d& force_N) const TRN_RT {
    return force_N.cwiseQuotient(config_.stiffness_N_mm);
  }
  const Eigen::Vector2d& deflection_mm() const TRN_RT { return deflection_mm_; }

 private:
  Eigen::Vector2d tooth_force(int tooth, int slice, const Eigen::Vector2d& centre, double edge_mm,
                              PartSurface& part) TRN_RT;
  Eigen::Vector2d centre_before(int teeth) const TRN_RT;

  Config config_;
  std::array<double, kTeeth> tooth_radius_mm_{};
  std::vector<Eigen::Vector2d> centres_;  ///< of the last steps, a ring
  std::size_t newest_ = 0;
  double steps_per_tooth_ = 0;
  double angle_rad_ = 0;
  Eigen::Vector2d deflection_mm_ = Eigen::Vector2d::Zero();
  bool cutting_ = false;
};

}  // namespace trn

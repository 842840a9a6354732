#pragma once

#include <span>
#include <vector>

namespace trn {

/// How a ball screw is held. Source: docs/sources.md S2.5.
enum class ScrewMounting : unsigned char { kFixedFree, kFixedFixed, kFixedPreload };

/// Displacement u (mm, away from the fixed bearing) of a warmed screw at `places_mm` (rising from 0 at the
/// fixed bearing to the screw's length), from its temperature rise there (K, linear in between): an encoder
/// that reads x means a nut at x + u(x). `stretch_mm` is what a preloaded screw was stretched by at assembly.
std::vector<double> screw_displacement(ScrewMounting mounting, double alpha_per_K, double stretch_mm,
                                       std::span<const double> places_mm, std::span<const double> rise_K);

/// What warms and cools a screw.
struct ScrewHeat {
  double diameter_mm = 40;
  double nut_friction_N = 120;     ///< force that the moving nut turns into heat where it runs
  double bearing_friction_N = 25;  ///< of each of the two bearings, reckoned along the way of the nut
  double cooling_W_m2K = 12;       ///< of the surface to the air
  double conductivity_W_mK = 45, density_kg_m3 = 7850, heat_J_kgK = 460;
};

/// The one-dimensional heat equation along a screw on equally spaced nodes, finite volumes, explicit steps.
class ScrewHeatModel {
 public:
  ScrewHeatModel(double length_mm, const ScrewHeat& heat, int nodes);

  /// `way_mm[i]`: way of the nut in the last dt_s around node i.
  void step(double dt_s, std::span<const double> way_mm);
  const std::vector<double>& rise_K() const { return rise_; }
  const std::vector<double>& places_mm() const { return places_; }

 private:
  void diffuse(double dt_s, const std::vector<double>& source_K_s);

  ScrewHeat heat_;
  std::vector<double> places_, rise_;
  double spacing_mm_, capacity_J_K_, conduction_1_s_, cooling_1_s_;
};

}  // namespace trn

#include "compensation/screw_heat.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trn {

std::vector<double> screw_displacement(ScrewMounting mounting, double alpha_per_K, double stretch_mm,
                                       std::span<const double> places_mm, std::span<const double> rise_K) {
  std::vector<double> u(places_mm.size(), 0.0);
  // U(x) of S2.5 by the trapezoid rule, which is exact for temperatures that are linear between nodes.
  for (std::size_t i = 1; i < u.size(); ++i)
    u[i] = u[i - 1] + alpha_per_K * (rise_K[i] + rise_K[i - 1]) / 2 * (places_mm[i] - places_mm[i - 1]);
  // What the far bearing holds back is taken from the whole length evenly.
  double held = 0;
  if (mounting == ScrewMounting::kFixedFixed) held = u.back();
  // The stretch of the assembly gives way first; only what grows beyond it moves the far bearing. A screw
  // that cools below the assembly's temperature is shorter and only stretched more.
  if (mounting == ScrewMounting::kFixedPreload) held = std::min(u.back(), stretch_mm);
  for (std::size_t i = 0; i < u.size(); ++i) u[i] -= places_mm[i] / places_mm.back() * held;
  return u;
}

ScrewHeatModel::ScrewHeatModel(double length_mm, const ScrewHeat& heat, int nodes)
    : heat_(heat), rise_(static_cast<std::size_t>(nodes), 0.0), spacing_mm_(length_mm / (nodes - 1)) {
  for (int i = 0; i < nodes; ++i) places_.push_back(i * spacing_mm_);
  const double area_m2 = std::numbers::pi * heat.diameter_mm * heat.diameter_mm / 4e6;
  const double per_m = heat.density_kg_m3 * heat.heat_J_kgK * area_m2;  // J/(K m)
  const double spacing_m = spacing_mm_ / 1000;
  // Everything of the heat model is in SI units per metre of screw; places and ways are in mm, hence the
  // thousands.
  capacity_J_K_ = per_m * spacing_m;
  conduction_1_s_ = heat.conductivity_W_mK * area_m2 / (per_m * spacing_m * spacing_m);
  cooling_1_s_ = heat.cooling_W_m2K * std::numbers::pi * heat.diameter_mm / 1000 / per_m;
}

void ScrewHeatModel::step(double dt_s, std::span<const double> way_mm) {
  std::vector<double> source(rise_.size(), 0.0);
  double way = 0;
  for (std::size_t i = 0; i < rise_.size(); ++i) {
    // Friction times way is work; over the heat that warms the cell by 1 K and over the time it is K/s.
    source[i] = heat_.nut_friction_N * way_mm[i] / 1000 / capacity_J_K_ / dt_s;
    way += way_mm[i];
  }
  const double bearing = heat_.bearing_friction_N * way / 1000 / capacity_J_K_ / dt_s;
  source.front() += bearing;
  source.back() += bearing;
  // An explicit step is stable while it moves less than all of a cell's heat. A half keeps clear of that, and
  // no node swings past its neighbours.
  const int parts = static_cast<int>(std::ceil(dt_s * (2 * conduction_1_s_ + cooling_1_s_) / 0.5));
  for (int i = 0; i < std::max(1, parts); ++i) diffuse(dt_s / std::max(1, parts), source);
}

void ScrewHeatModel::diffuse(double dt_s, const std::vector<double>& source_K_s) {
  const std::size_t n = rise_.size();
  const std::vector<double> T = rise_;
  for (std::size_t i = 0; i < n; ++i) {
    const double left = i > 0 ? T[i - 1] - T[i] : 0, right = i + 1 < n ? T[i + 1] - T[i] : 0;
    const double share = i == 0 || i + 1 == n ? 0.5 : 1;  // the volumes at the ends are halves
    rise_[i] += dt_s * ((conduction_1_s_ * (left + right) + source_K_s[i]) / share - cooling_1_s_ * T[i]);
  }
}

}  // namespace trn

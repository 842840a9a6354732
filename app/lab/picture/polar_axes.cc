#include "app/lab/picture/polar_axes.h"

#include <fmt/format.h>

#include <cmath>

#include "app/lab/picture/axes.h"
#include "core/units.h"

namespace trn::picture {

namespace {

constexpr double kBasePx = 170, kRingPx = 24, kHubPx = 20;
constexpr double kEdgePx = kBasePx + (PolarAxes::kRings + 0.4) * kRingPx;

}  // namespace

PolarAxes::PolarAxes(Px centre, double peak) : centre_(centre), per_ring_(round_up(peak / kRings)) {}

double PolarAxes::reach_px() { return kEdgePx + 32; }

Px PolarAxes::on(double angle_rad, double radius_px) const {
  return {centre_.x + radius_px * std::cos(angle_rad), centre_.y - radius_px * std::sin(angle_rad)};
}

Px PolarAxes::at(double angle_rad, double deviation) const {
  return on(angle_rad, kBasePx + kRingPx * deviation / per_ring_);
}

void PolarAxes::draw(Svg& svg, const std::string& unit) const {
  for (int k = -kRings; k <= kRings; ++k)
    svg.circle(centre_, kBasePx + k * kRingPx, k == 0 ? kInk : kGrid, k == 0 ? 1.4 : 1);
  for (int k = 0; k < 12; ++k) {
    const double angle = k * kPi / 6;
    svg.line(on(angle, kHubPx), on(angle, kEdgePx), kGrid);
    const Px label = on(angle, kEdgePx + 15);
    svg.text(label.x, label.y + 4, fmt::format("{}°", 30 * k), {"middle"});
  }
  for (const int k : {-kRings, 0, kRings}) {  // between two spokes, where no other text is
    const Px label = on(kPi * 5 / 12, kBasePx + k * kRingPx);
    const std::string words = fmt::format("{}{} {}", k > 0 ? "+" : "", tick_text(k * per_ring_), unit);
    const double width = text_width_px(words, 11);
    svg.fill({label.x - width / 2, label.y - 7, width, 14}, "white", 0.85);
    svg.text(label.x, label.y + 4, words, {"middle", 11});
  }
}

}  // namespace trn::picture

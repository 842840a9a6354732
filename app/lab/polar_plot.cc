#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/lab/ballbar_run.h"
#include "core/units.h"

namespace trn {

namespace {

constexpr double kCentreX = 320, kCentreY = 340, kBasePx = 170, kDivisionPx = 24;
constexpr int kDivisions = 5;

/// 1, 2 or 5 times a power of ten, so that `peak` fits into the divisions.
double um_per_division(double peak_um) {
  double scale = 1e-6;
  for (int step = 0; scale * kDivisions < peak_um && step < 60; ++step) scale *= step % 3 == 1 ? 2.5 : 2;
  return scale;
}

std::string point(double angle, double radius) {
  return fmt::format("{:.2f},{:.2f}", kCentreX + radius * std::cos(angle),
                     kCentreY - radius * std::sin(angle));
}

std::string circle(double radius, const char* style) {
  return fmt::format("<circle cx='{:g}' cy='{:g}' r='{:.2f}' fill='none' {}/>\n", kCentreX, kCentreY, radius,
                     style);
}

std::string grid() {
  std::string out;
  for (int k = -kDivisions; k <= kDivisions; ++k)
    out += circle(kBasePx + k * kDivisionPx,
                  k == 0 ? "stroke='#444' stroke-width='1.2'" : "stroke='#ccc' stroke-width='0.6'");
  for (int k = 0; k < 12; ++k) {
    const double a = k * kPi / 6, edge = kBasePx + (kDivisions + 0.4) * kDivisionPx;
    out += fmt::format("<polyline points='{} {}' stroke='#ddd' stroke-width='0.6'/>\n", point(a, 20),
                       point(a, edge));
    const double x = kCentreX + (edge + 14) * std::cos(a), y = kCentreY - (edge + 14) * std::sin(a) + 4;
    out += fmt::format("<text x='{:.1f}' y='{:.1f}' text-anchor='middle' font-size='11'>{}°</text>\n", x, y,
                       30 * k);
  }
  return out;
}

std::string curve(const PolarCurve& c, double um_per_px) {
  std::string points;
  const std::size_t n = c.trace->readings.size(), every = std::max<std::size_t>(1, n / 1500);
  for (std::size_t i = 0; i < n; i += every) {
    const BallbarReading& r = c.trace->readings[i];
    points += point(r.angle_rad, kBasePx + 1000 * r.reading_mm / um_per_px) + " ";
  }
  return fmt::format("<polyline points='{}' fill='none' stroke='{}' stroke-width='1.6'/>\n", points,
                     c.colour);
}

}  // namespace

std::string polar_plot(const std::string& title, const std::vector<PolarCurve>& curves) {
  double peak_um = 0;
  for (const PolarCurve& c : curves)
    for (const BallbarReading& r : c.trace->readings)
      peak_um = std::max(peak_um, 1000 * std::abs(r.reading_mm));
  const double scale = um_per_division(peak_um);
  const double height = 684 + 20 * static_cast<double>(curves.size());
  std::string out = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='-20 0 680 {0:g}' font-family='sans-serif'>\n"
      "<rect x='-20' width='680' height='{0:g}' fill='white'/>\n",
      height);
  out += fmt::format("<text x='20' y='28' font-size='17'>{}</text>\n", title);
  out += fmt::format(
      "<text x='20' y='48' font-size='12'>{:g} um per division; dark circle: nominal length</text>\n", scale);
  out += grid();
  double y = 686;
  for (const PolarCurve& c : curves) {
    out += curve(c, scale / kDivisionPx);
    out += fmt::format("<rect x='20' y='{:g}' width='22' height='4' fill='{}'/>", y - 6, c.colour);
    out += fmt::format("<text x='50' y='{:g}' font-size='13'>{}: deviation {:.4g} um</text>\n", y, c.label,
                       1000 * c.trace->peak_to_peak_mm());
    y += 20;
  }
  return out + "</svg>\n";
}

}  // namespace trn

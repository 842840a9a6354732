#include "app/lab/polar_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/lab/picture/axes.h"
#include "app/lab/picture/polar_axes.h"
#include "app/lab/picture/svg.h"

namespace trn {

namespace {

constexpr double kPolarWidth = 680, kMargin = 20, kPolarTop = 60, kUmPerMm = 1000;
constexpr double kLeastShownUm = 1e-6;  // less is rounding

/// Greatest deviation of all readings, um.
double peak_um(const std::vector<PolarCurve>& curves) {
  double peak = kLeastShownUm;
  for (const PolarCurve& c : curves)
    for (const BallbarReading& r : c.trace->readings)
      peak = std::max(peak, kUmPerMm * std::abs(r.reading_mm));
  return peak;
}

}  // namespace

std::string polar_plot(const std::string& title, const std::vector<PolarCurve>& curves) {
  const double reach = picture::PolarAxes::reach_px();
  const double below = kPolarTop + 2 * reach + 20;
  picture::Svg svg(kPolarWidth, below + 20 * static_cast<double>(curves.size()));
  const picture::PolarAxes axes({kPolarWidth / 2, kPolarTop + reach}, peak_um(curves));
  svg.text(kMargin, 28, title, {"start", 17, false, kPolarWidth - 2 * kMargin});
  svg.text(kMargin, 48,
           fmt::format("{:g} µm from ring to ring; dark circle: nominal length", axes.per_ring()));
  axes.draw(svg, "µm");
  double y = below;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const PolarCurve& c = curves[i];
    std::vector<picture::Px> points;
    for (const BallbarReading& r : c.trace->readings)
      points.push_back(axes.at(r.angle_rad, kUmPerMm * r.reading_mm));
    // Earlier ones are wider, so that curves on top of each other show as edges.
    const double wider = curves.size() > 2 ? static_cast<double>(curves.size() - 1 - i) : 0;
    svg.polyline(points, picture::line_colour(i), 1.5 + 0.8 * wider);
    const double deviation_um = kUmPerMm * c.trace->peak_to_peak_mm();
    y = draw_legend(
        svg, kMargin, y, kPolarWidth - kMargin,
        {{fmt::format("{}: deviation {:.4g} µm", c.label, deviation_um < kLeastShownUm ? 0 : deviation_um),
          picture::line_colour(i)}});
  }
  return svg.str();
}

}  // namespace trn

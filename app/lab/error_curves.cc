#include "app/lab/error_curves.h"

#include <fmt/format.h>

#include "app/lab/joint_measure.h"
#include "app/lab/picture/axes.h"
#include "app/lab/picture/svg.h"

namespace trn {

namespace {

using picture::Axes;
using picture::line_colour;
using picture::Svg;

constexpr double kCurvesWidth = 800, kCurvesLeft = 80, kCurvesRight = 25, kPlot = 170, kEach = 262,
                 kCurvesTop = 100;
const char* const kForward = line_colour(1);
const char* const kBackward = line_colour(0);
const char* const kAfter = line_colour(2);

/// Actual less commanded, without the place of the scale's zero.
double error_of(const AxisMeasurement& m, const ErrorCurve& c) {
  return m.actual - m.commanded - c.fit.datum;
}

Axes axes_of(const ErrorCurve& c, double top) {
  std::vector<double> places, errors{0};
  for (const AxisMeasurement& m : *c.measured) {
    places.push_back(m.commanded);
    errors.push_back(error_of(m, c));
  }
  if (c.after)
    for (const AxisMeasurement& m : *c.after) errors.push_back(m.actual - m.commanded);
  return {{kCurvesLeft, top, kCurvesWidth - kCurvesLeft - kCurvesRight, kPlot},
          picture::Range::over(places, 0.02),
          picture::Range::over(errors, 0.08)};
}

void draw_dots(Svg& svg, const ErrorCurve& c, const Axes& axes) {
  for (std::size_t i = 0; i < c.measured->size(); ++i) {
    const AxisMeasurement& m = (*c.measured)[i];
    svg.dot(axes.at(m.commanded, error_of(m, c)), 2.5, c.fit.direction[i] > 0 ? kForward : kBackward);
  }
  if (!c.after) return;
  for (const AxisMeasurement& m : *c.after) svg.dot(axes.at(m.commanded, m.actual - m.commanded), 2, kAfter);
}

void draw_fit(Svg& svg, const ErrorCurve& c, const Axes& axes, int direction) {
  std::vector<picture::Px> points;
  const auto& curve = direction > 0 ? c.fit.forward : c.fit.backward;
  for (std::size_t i = 0; i < c.fit.at.size(); ++i) points.push_back(axes.at(c.fit.at[i], curve[i]));
  if (c.fit.at.empty())
    for (const double at : {axes.x().low, axes.x().high})
      points.push_back(axes.at(at, (1 / (1 + c.fit.slope) - 1) * at - direction * c.fit.backlash / 2));
  svg.polyline(points, direction > 0 ? kForward : kBackward);
}

void draw_joint(Svg& svg, const ErrorCurve& c, double top) {
  const Axes axes = axes_of(c, top);
  std::string title = fmt::format("{}: slope {:.6g} ± {:.1g}, backlash {:.4g} {}", c.joint, c.fit.slope,
                                  c.fit.slope_deviation, c.fit.backlash, c.unit);
  if (c.after)
    title += fmt::format("; error up to {:.4g}, corrected {:.4g} {}", error_amplitude(*c.measured),
                         error_amplitude(*c.after), c.unit);
  svg.text(kCurvesLeft, top - 26, title, {"start", 12, true, kCurvesWidth - kCurvesLeft - kCurvesRight});
  axes.draw(svg, fmt::format("commanded place, {}", c.unit), fmt::format("error, {}", c.unit));
  draw_fit(svg, c, axes, 1);
  draw_fit(svg, c, axes, -1);
  draw_dots(svg, c, axes);
}

}  // namespace

std::string error_curves(const std::vector<ErrorCurve>& curves) {
  Svg svg(kCurvesWidth, kCurvesTop - 48 + kEach * static_cast<double>(curves.size()));
  svg.text(kCurvesLeft, 24, "Error of the axis, actual less commanded", {"start", 16});
  std::vector<picture::LegendEntry> legend{{"measured forward, and fit", kForward},
                                           {"measured backward, and fit", kBackward}};
  for (const ErrorCurve& c : curves)
    if (c.after && legend.size() == 2) legend.push_back({"with correction", kAfter});
  draw_legend(svg, kCurvesLeft, 46, kCurvesWidth - kCurvesRight, legend);
  for (std::size_t i = 0; i < curves.size(); ++i)
    draw_joint(svg, curves[i], kCurvesTop + kEach * static_cast<double>(i));
  return svg.str();
}

}  // namespace trn

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/lab/joint_measure.h"

namespace trn {

namespace {

constexpr double kLeft = 70, kWidth = 600, kHeight = 180, kEach = 230;
constexpr const char* kForward = "#c0392b";
constexpr const char* kBackward = "#1f6fb2";
constexpr const char* kAfter = "#27ae60";

/// Scales of one diagram.
struct Frame {
  double low = 1e300, high = -1e300, peak = 1e-9, top = 0;
  double x(double at) const { return kLeft + kWidth * (at - low) / std::max(1e-9, high - low); }
  double y(double e) const { return top + kHeight / 2 + 20 - kHeight / 2 * e / peak; }
};

Frame frame_of(const ErrorCurve& c, double top) {
  Frame f;
  f.top = top;
  for (const AxisMeasurement& m : *c.measured) {
    f.low = std::min(f.low, m.commanded);
    f.high = std::max(f.high, m.commanded);
    f.peak = std::max(f.peak, std::abs(m.actual - m.commanded - c.fit.datum));
  }
  return f;
}

std::string dots(const ErrorCurve& c, const Frame& f) {
  std::string out;
  for (std::size_t i = 0; i < c.measured->size(); ++i) {
    const AxisMeasurement& m = (*c.measured)[i];
    out +=
        fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='2' fill='{}'/>", f.x(m.commanded),
                    f.y(m.actual - m.commanded - c.fit.datum), c.fit.direction[i] > 0 ? kForward : kBackward);
  }
  if (c.after)
    for (const AxisMeasurement& m : *c.after)
      out += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='1.6' fill='{}'/>", f.x(m.commanded),
                         f.y(m.actual - m.commanded), kAfter);
  return out + "\n";
}

std::string fitted(const ErrorCurve& c, const Frame& f, int direction) {
  std::string points;
  const auto& curve = direction > 0 ? c.fit.forward : c.fit.backward;
  for (std::size_t i = 0; i < c.fit.at.size(); ++i)
    points += fmt::format("{:.1f},{:.1f} ", f.x(c.fit.at[i]), f.y(curve[i]));
  if (c.fit.at.empty())
    for (const double at : {f.low, f.high})
      points += fmt::format("{:.1f},{:.1f} ", f.x(at),
                            f.y((1 / (1 + c.fit.slope) - 1) * at - direction * c.fit.backlash / 2));
  return fmt::format("<polyline points='{}' fill='none' stroke='{}'/>\n", points,
                     direction > 0 ? kForward : kBackward);
}

std::string diagram(const ErrorCurve& c, double top) {
  const Frame f = frame_of(c, top);
  const std::string after = c.after
                                ? fmt::format("; error up to {:.4g}, corrected {:.4g} {}",
                                              error_amplitude(*c.measured), error_amplitude(*c.after), c.unit)
                                : "";
  std::string out = fmt::format(
      "<text x='{}' y='{}' font-size='11'>{}: slope {:.6g} +- {:.1g}, backlash {:.4g} {}{}</text>\n", kLeft,
      top + 12, c.joint, c.fit.slope, c.fit.slope_deviation, c.fit.backlash, c.unit, after);
  out += fmt::format("<line x1='{}' y1='{:.1f}' x2='{}' y2='{:.1f}' stroke='#999'/>\n", kLeft, f.y(0),
                     kLeft + kWidth, f.y(0));
  for (const double e : {f.peak, -f.peak})
    out += fmt::format("<text x='8' y='{:.1f}' font-size='11'>{:.3g} {}</text>\n", f.y(e) + (e > 0 ? 8 : 0),
                       e, c.unit);
  for (const double at : {f.low, f.high})
    out += fmt::format("<text x='{:.1f}' y='{:.1f}' font-size='11' text-anchor='middle'>{:.4g}</text>\n",
                       f.x(at), f.y(0) - 4, at);
  return out + dots(c, f) + fitted(c, f, 1) + fitted(c, f, -1);
}

}  // namespace

std::string error_curves(const std::vector<ErrorCurve>& curves) {
  const double height = 40 + kEach * static_cast<double>(curves.size());
  std::string out = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 720 {0:g}' font-family='sans-serif'>\n"
      "<rect width='720' height='{0:g}' fill='white'/>\n"
      "<text x='10' y='20' font-size='14'>Error of the axis, actual less commanded: <tspan fill='{1}'>forward"
      "</tspan>, <tspan fill='{2}'>backward</tspan>, <tspan fill='{3}'>corrected</tspan></text>\n",
      height, kForward, kBackward, kAfter);
  for (std::size_t i = 0; i < curves.size(); ++i)
    out += diagram(curves[i], 40 + kEach * static_cast<double>(i));
  return out + "</svg>\n";
}

}  // namespace trn

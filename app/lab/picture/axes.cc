#include "app/lab/picture/axes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace trn::picture {

namespace {

constexpr double kPxPerTickX = 45, kPxPerTickY = 32;
constexpr int kShades = 16;
constexpr double kApartPx = 10;  // of two numbers along x

/// Ticks along an axis of `width` px whose numbers do not touch.
std::vector<double> ticks_apart(const Range& range, double width) {
  std::vector<double> out;
  for (double count = width / kPxPerTickX; count >= 1; count /= 2) {
    out = ticks(range, count);
    double widest = 0;
    for (const double value : out) widest = std::max(widest, text_width_px(tick_text(value), 12));
    if (static_cast<double>(out.size()) * (widest + kApartPx) <= width) break;
  }
  return out;
}

}  // namespace

double round_up(double least) {
  if (!(least > 0) || !std::isfinite(least)) return 1;
  const double ten = std::pow(10.0, std::floor(std::log10(least)));
  for (const double step : {1.0, 2.0, 5.0})
    if (step * ten >= least * (1 - 1e-9)) return step * ten;
  return 10 * ten;
}

Range Range::over(const std::vector<double>& values, double margin) {
  Range out{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const double value : values) {
    if (std::isnan(value)) continue;
    out.low = std::min(out.low, value);
    out.high = std::max(out.high, value);
  }
  if (out.low > out.high) return {};
  // Values of a width that their own rounding makes up are one value.
  const double least = 1e-12 * std::max(std::abs(out.low), std::abs(out.high));
  if (out.high - out.low <= least) out.high = out.low + std::max(1.0, 1e3 * least);
  const double more = margin * (out.high - out.low);
  return {out.low - more, out.high + more};
}

std::vector<double> ticks(const Range& range, double count) {
  const double step = round_up((range.high - range.low) / count);
  const double slack = 1e-9 * step;
  std::vector<double> out;
  for (double k = std::ceil((range.low - slack) / step); k * step <= range.high + slack; ++k)
    out.push_back(k * step);
  return out;
}

// Twelve digits hide that 3 times 0.1 is not 0.3.
std::string tick_text(double value) { return fmt::format("{:.12g}", value + 0.0); }

Px Axes::at(double x, double y) const {
  return {box_.left + box_.width * (x - x_.low) / (x_.high - x_.low),
          box_.bottom() - box_.height * (y - y_.low) / (y_.high - y_.low)};
}

void Axes::make_square() {
  const double per_px = std::max((x_.high - x_.low) / box_.width, (y_.high - y_.low) / box_.height);
  const auto widen = [&](Range& range, double px) {
    const double middle = (range.low + range.high) / 2;
    range = {middle - per_px * px / 2, middle + per_px * px / 2};
  };
  widen(x_, box_.width);
  widen(y_, box_.height);
}

void Axes::draw(Svg& svg, const std::string& x_label, const std::string& y_label) const {
  for (const double y : ticks(y_, box_.height / kPxPerTickY)) {
    const double at_y = at(x_.low, y).y;
    svg.line({box_.left, at_y}, {box_.right(), at_y}, kGrid);
    svg.text(box_.left - 6, at_y + 4, tick_text(y), {"end", 12, false, box_.left - 8});
  }
  for (const double x : ticks_apart(x_, box_.width)) {
    const double at_x = at(x, y_.low).x;
    svg.line({at_x, box_.top}, {at_x, box_.bottom()}, kGrid);
    if (!x_label.empty()) svg.text(at_x, box_.bottom() + 17, tick_text(x), {"middle"});
  }
  if (y_.low < 0 && y_.high > 0) svg.line(at(x_.low, 0), at(x_.high, 0), kAxis);
  svg.frame(box_);
  svg.text(box_.left, box_.top - 7, y_label, {"start", 12, false, svg.width() - box_.left - 10});
  svg.text(box_.left + box_.width / 2, box_.bottom() + 35, x_label, {"middle"});
}

double draw_legend(Svg& svg, double x, double y, double right, const std::vector<LegendEntry>& entries) {
  constexpr double kMark = 18, kRow = 20;
  double at = x;
  for (const LegendEntry& entry : entries) {
    const double width = kMark + 6 + text_width_px(entry.name, 12);
    if (at > x && at + width > right) at = x, y += kRow;
    svg.fill({at, y - 7, kMark, 5}, entry.colour);
    svg.text(at + kMark + 6, y, entry.name, {"start", 12, false, right - at - kMark - 6});
    at += width + 14;
  }
  return y + kRow;
}

void draw_shades(Svg& svg, Px left_top, double width, const std::string& low, const std::string& high) {
  for (int k = 0; k < kShades; ++k)
    svg.fill({left_top.x + width * k / kShades, left_top.y, width / kShades + 0.2, 10},
             shade(static_cast<double>(k) / (kShades - 1)));
  svg.text(left_top.x, left_top.y + 24, low);
  svg.text(left_top.x + width, left_top.y + 24, high, {"end"});
}

}  // namespace trn::picture

#include "app/lab/picture/svg_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>

namespace trn {

namespace {

constexpr double kWidth = 900, kHeight = 560, kLeft = 80, kRight = 30, kTop = 50, kBottom = 60;
constexpr const char* kColours[] = {"#1b6ca8", "#d1495b", "#2e8b57", "#b8860b", "#6a4c93"};
constexpr std::size_t kPointsMax = 1500;  // of a curve; more would not be seen

// A step of 1, 2 or 5 times a power of ten that gives about six ticks.
double tick_step(double range) {
  const double power = std::pow(10.0, std::floor(std::log10(range / 6)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (range / (factor * power) <= 8) return factor * power;
  return 10 * power;
}

std::string text(double x, double y, const char* anchor, const std::string& words, const char* more = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" {}>{}</text>\n", x, y, anchor, more,
                     words);
}

}  // namespace

double SvgChart::Frame::px(double x) const {
  return kLeft + (x - x0) / (x1 - x0) * (kWidth - kLeft - kRight);
}
double SvgChart::Frame::py(double y) const {
  return kHeight - kBottom - (y - y0) / (y1 - y0) * (kHeight - kTop - kBottom);
}

void SvgChart::add(const std::string& name, std::vector<double> x, std::vector<double> y) {
  curves_.push_back({name, std::move(x), std::move(y)});
}

SvgChart::Frame SvgChart::frame() const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Frame f{kInfinity, -kInfinity, kInfinity, -kInfinity};
  for (const Curve& curve : curves_) {
    for (const double x : curve.x) f.x0 = std::min(f.x0, x), f.x1 = std::max(f.x1, x);
    for (const double y : curve.y) f.y0 = std::min(f.y0, y), f.y1 = std::max(f.y1, y);
  }
  if (!(f.x1 > f.x0)) f.x1 = f.x0 + 1;
  if (!(f.y1 > f.y0)) f.y1 = f.y0 + 1;
  const double margin = 0.05 * (f.y1 - f.y0);
  f.y0 -= margin;
  f.y1 += margin;
  if (!square_) return f;
  const double per_px =
      std::max((f.x1 - f.x0) / (kWidth - kLeft - kRight), (f.y1 - f.y0) / (kHeight - kTop - kBottom));
  const double x = (f.x0 + f.x1) / 2, y = (f.y0 + f.y1) / 2;
  const double half_x = per_px * (kWidth - kLeft - kRight) / 2,
               half_y = per_px * (kHeight - kTop - kBottom) / 2;
  return {x - half_x, x + half_x, y - half_y, y + half_y};
}

std::string SvgChart::axes(const Frame& f) {
  const double bottom = kHeight - kBottom, right = kWidth - kRight;
  std::string out =
      fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#444\"/>\n",
                  kLeft, kTop, right - kLeft, bottom - kTop);
  const char* line = "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#ddd\"/>\n";
  const double dx = tick_step(f.x1 - f.x0), dy = tick_step(f.y1 - f.y0);
  for (double x = std::ceil(f.x0 / dx) * dx; x <= f.x1; x += dx) {
    out += fmt::format(fmt::runtime(line), f.px(x), kTop, f.px(x), bottom);
    out += text(f.px(x), bottom + 20, "middle", fmt::format("{:g}", std::abs(x) < dx / 1e6 ? 0 : x));
  }
  for (double y = std::ceil(f.y0 / dy) * dy; y <= f.y1; y += dy) {
    out += fmt::format(fmt::runtime(line), kLeft, f.py(y), right, f.py(y));
    out += text(kLeft - 8, f.py(y) + 4, "end", fmt::format("{:g}", std::abs(y) < dy / 1e6 ? 0 : y));
  }
  return out;
}

std::string SvgChart::polyline(const Frame& f, const Curve& curve, const char* colour) {
  const std::string begin =
      fmt::format("<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.4\" points=\"", colour);
  std::string out = begin;
  const std::size_t stride = 1 + curve.x.size() / kPointsMax;
  bool shown = true;  // the last gap is in the picture
  for (std::size_t k = 0; k < curve.x.size(); ++k) {
    shown = shown && !std::isnan(curve.y[k]);
    if (k % stride != 0 || std::isnan(curve.y[k])) continue;
    if (!shown) out += "\"/>\n" + begin;
    shown = true;
    out += fmt::format("{:.1f},{:.1f} ", f.px(curve.x[k]), f.py(curve.y[k]));
  }
  return out + "\"/>\n";
}

void SvgChart::write(const std::string& path) const {
  const Frame f = frame();
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" "
      "font-size=\"13\">\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
      kWidth, kHeight);
  out += axes(f) + text(kWidth / 2, 26, "middle", title_, "font-size=\"17\"");
  out += text(kWidth / 2, kHeight - 16, "middle", x_label_);
  out += text(0, 0, "middle", y_label_,
              fmt::format("transform=\"translate(20 {}) rotate(-90)\"", kHeight / 2).c_str());
  for (std::size_t i = 0; i < curves_.size(); ++i) {
    const Curve& curve = curves_[i];
    const char* colour = kColours[i % std::size(kColours)];
    out += polyline(f, curve, colour);
    const double y = kTop + 18 + 18 * static_cast<double>(i);
    out += fmt::format("<line x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\" stroke=\"{}\" stroke-width=\"3\"/>\n",
                       kWidth - 300, y - 4, kWidth - 275, y - 4, colour);
    out += text(kWidth - 268, y, "start", curve.name);
  }
  std::ofstream file(path);
  file << out << "</svg>\n";
  file.close();
  if (!file) throw std::runtime_error(fmt::format("{}: cannot write the picture", path));
}

}  // namespace trn

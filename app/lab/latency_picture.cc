#include "app/lab/latency_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/lab/picture/colours.h"
#include "app/lab/picture/svg.h"

namespace trn {

namespace {

using picture::Box;
using picture::Svg;

constexpr double kLatencyWidth = 820, kLatencyHeight = 430, kLatencyLeft = 70, kLatencyTop = 60,
                 kLatencyPanel = 130, kLatencyGap = 50, kLatencyRight = 20;
constexpr double kEdgesAnOctave = 4;  // as TimeHistogram has them

struct Scale {
  double decades_us;     ///< of the axis, from 1 us on
  double decades_count;  ///< of the counts, from 1 on
  double x(double us) const {
    return kLatencyLeft +
           (kLatencyWidth - kLatencyLeft - kLatencyRight) * std::clamp(std::log10(us) / decades_us, 0.0, 1.0);
  }
  double height(double count) const {
    return count <= 0 ? 0 : kLatencyPanel * (std::log10(count) + 0.3) / (decades_count + 0.3);
  }
};

std::string time_text(double us) {
  if (us < 1000) return fmt::format("{:g} us", us);
  return us < 1e6 ? fmt::format("{:g} ms", us / 1000) : fmt::format("{:g} s", us / 1e6);
}

void draw_panel(Svg& svg, double top, const std::string& name,
                const std::vector<TimeHistogram::Bucket>& buckets, const Scale& scale, const char* colour) {
  const double bottom = top + kLatencyPanel;
  svg.text(kLatencyLeft, top - 8, name, {.size = 13, .bold = true});
  for (int decade = 0; decade <= scale.decades_us; ++decade) {
    const double us = std::pow(10, decade), x = scale.x(us);
    svg.line({x, top}, {x, bottom}, picture::kGrid);
    svg.text(x, bottom + 16, time_text(us), {.anchor = "middle"});
  }
  for (int decade = 0; decade <= scale.decades_count; ++decade) {
    const double count = std::pow(10, decade), y = bottom - scale.height(count);
    svg.line({kLatencyLeft, y}, {kLatencyWidth - kLatencyRight, y}, picture::kGrid);
    svg.text(kLatencyLeft - 6, y + 4, fmt::format("{:g}", count), {.anchor = "end", .size = 11});
  }
  for (const TimeHistogram::Bucket& bucket : buckets) {
    const double octave = std::exp2(std::floor(std::log2(bucket.edge_us) - 1e-9));
    const double from = scale.x(std::max(1.0, bucket.edge_us - octave / kEdgesAnOctave)),
                 to = scale.x(bucket.edge_us);
    const double height = scale.height(bucket.count);
    if (height > 0) svg.fill(Box{from, bottom - height, std::max(1.0, to - from - 1), height}, colour);
  }
  svg.frame(Box{kLatencyLeft, top, kLatencyWidth - kLatencyLeft - kLatencyRight, kLatencyPanel});
}

}  // namespace

std::string latency_svg(const std::string& title, const std::vector<TimeHistogram::Bucket>& wake,
                        const std::vector<TimeHistogram::Bucket>& tick) {
  double longest_us = 100, most = 10;
  for (const auto* buckets : {&wake, &tick})
    for (const TimeHistogram::Bucket& bucket : *buckets) {
      longest_us = std::max(longest_us, bucket.edge_us);
      most = std::max(most, static_cast<double>(bucket.count));
    }
  const Scale scale{std::ceil(std::log10(longest_us)), std::ceil(std::log10(most))};
  Svg svg(kLatencyWidth, kLatencyHeight);
  svg.text(kLatencyLeft, 26, title, {.size = 15, .bold = true});
  draw_panel(svg, kLatencyTop, "how late the tick woke: periods", wake, scale, picture::line_colour(0));
  draw_panel(svg, kLatencyTop + kLatencyPanel + kLatencyGap, "how long the tick took: periods", tick, scale,
             picture::line_colour(1));
  return svg.str();
}

}  // namespace trn

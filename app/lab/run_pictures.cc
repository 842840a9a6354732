#include "app/lab/run_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "app/lab/picture/axes.h"
#include "app/lab/picture/svg.h"
#include "app/lab/run_report.h"
#include "app/lab/text_file.h"

namespace trn {

namespace {

using picture::Axes;
using picture::kLineColours;
using picture::Px;
using picture::Svg;

constexpr double kRunWidth = 1000, kRunLeft = 80, kRunRight = 20, kRunPanel = 150, kRunGap = 40, kRunTop = 86;
constexpr double kDeviationSide = 405;
constexpr float kAtLimit = 0.95F;  // as in the summary
constexpr const char* kFree = picture::kNeutral;
static_assert(kLineColours.size() >= kMaxJoints);

const char* colour_of(const RunBin& bin) {
  return bin.worst >= kAtLimit && bin.worst_joint >= 0
             ? kLineColours[static_cast<std::size_t>(bin.worst_joint)]
             : kFree;
}

Svg begin(double height, const std::string& title) {
  Svg svg(kRunWidth, height);
  svg.text(kRunLeft, 26, title, {"start", 17});
  return svg;
}

double end_s(const std::vector<RunBin>& bins) { return bins.empty() ? 1 : std::max(bins.back().t_s, 1e-3); }

/// The `index`-th of three diagrams over time, one under the other; y from 0.
Axes panel(const std::vector<RunBin>& bins, int index, double y_max) {
  return {{kRunLeft, kRunTop + index * (kRunPanel + kRunGap), kRunWidth - kRunLeft - kRunRight, kRunPanel},
          {0, end_s(bins)},
          {0, y_max}};
}
constexpr double kPanelsEnd = kRunTop + 3 * (kRunPanel + kRunGap);
const char* time_label(int index) { return index == 2 ? "time, s" : ""; }

/// Value over time; a new line where the colour changes.
template <typename Value, typename Colour>
void draw_curve(Svg& svg, const Axes& axes, const std::vector<RunBin>& bins, Value value, Colour colour) {
  std::vector<Px> points;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    points.push_back(axes.at(bins[i].t_s, value(bins[i])));
    const bool last = i + 1 == bins.size();
    if (!last && std::string_view(colour(bins[i])) == colour(bins[i + 1])) continue;
    if (!last) points.push_back(axes.at(bins[i + 1].t_s, value(bins[i + 1])));
    svg.polyline(points, colour(bins[i]), 1.3);
    points.clear();
  }
}

void draw_key(Svg& svg, const Machine& machine, bool with_free) {
  std::vector<picture::LegendEntry> entries;
  for (std::size_t i = 0; i < machine.joints.size(); ++i)
    entries.push_back({machine.joints[i].name, kLineColours[i]});
  if (with_free) entries.push_back({"no joint: the feed, or the way there and back", kFree});
  draw_legend(svg, kRunLeft, 50, kRunWidth - kRunRight, entries);
}

template <typename Value>
double largest(const std::vector<RunBin>& bins, Value value) {
  double out = 0;
  for (const RunBin& bin : bins) out = std::max<double>(out, value(bin));
  return out;
}

/// Fewer bins, the worst of each: enough for lines that lie over each other.
std::vector<RunBin> thinned(const std::vector<RunBin>& bins, std::size_t count) {
  const std::size_t per = std::max<std::size_t>(1, bins.size() / count);
  std::vector<RunBin> out;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    if (i % per == 0) {
      out.push_back(bins[i]);
      continue;
    }
    RunBin& to = out.back();
    for (std::size_t j = 0; j < kMaxJoints; ++j) {
      to.velocity[j] = std::max(to.velocity[j], bins[i].velocity[j]);
      to.acceleration[j] = std::max(to.acceleration[j], bins[i].acceleration[j]);
      to.jerk[j] = std::max(to.jerk[j], bins[i].jerk[j]);
    }
  }
  return out;
}

void draw_usage(Svg& svg, const Machine& machine, const SimulationResult& result, double top) {
  svg.text(
      kRunLeft, top - 8,
      "time at 95 % of a limit or more: velocity, acceleration, jerk (dark to light); % of the cycle time");
  const double all = std::max(result.cycle_time_s, 1e-9), scale = (kRunWidth - kRunLeft - kRunRight) / 100;
  for (std::size_t i = 0; i < machine.joints.size(); ++i) {
    const double y = top + 22 * static_cast<double>(i);
    const TimeAtLimit& at = result.at_limit[i];
    svg.text(kRunLeft - 6, y + 13, machine.joints[i].name, {"end", 12, false, kRunLeft - 10});
    double x = kRunLeft;
    for (const auto& [time_s, opacity] :
         {std::pair{at.velocity, 1.0}, {at.acceleration, 0.65}, {at.jerk, 0.35}}) {
      const double width = std::min(100 * time_s / all * scale, kRunWidth - kRunRight - x);
      svg.fill({x, y, width, 16}, kLineColours[i], opacity);
      x += width;
    }
    const std::string shares = fmt::format("{:.1f}, {:.1f}, {:.1f}", 100 * at.velocity / all,
                                           100 * at.acceleration / all, 100 * at.jerk / all);
    const bool beside = x + 6 + picture::text_width_px(shares, 12) < kRunWidth;
    svg.text(beside ? x + 6 : kRunWidth - kRunRight - 6, y + 13, shares, {beside ? "start" : "end"});
  }
}

/// The way seen along one axis, the same scale both ways, in sixteen shades of speed.
void draw_projection(Svg& svg, const std::vector<RunBin>& bins, int right, int up, double left, double side) {
  std::vector<double> across, upwards;
  for (const RunBin& bin : bins)
    if (bin.on_path) {
      across.push_back(bin.p_W[right]);
      upwards.push_back(bin.p_W[up]);
    }
  Axes axes({left, kRunTop, side, side}, picture::Range::over(across, 0.04),
            picture::Range::over(upwards, 0.04));
  axes.make_square();
  axes.draw(svg, fmt::format("{}, mm", "XYZ"[right]), fmt::format("{}, mm", "XYZ"[up]));
  const double fastest = std::max(largest(bins, [](const RunBin& b) { return b.speed_mm_s; }), 1e-9);
  const auto level = [&](const RunBin& b) { return std::lround(15 * b.speed_mm_s / fastest); };
  const auto place = [&](const RunBin& b) { return axes.at(b.p_W[right], b.p_W[up]); };
  std::vector<Px> points;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    if (!bins[i].on_path) continue;
    points.push_back(place(bins[i]));
    const bool last = i + 1 == bins.size() || !bins[i + 1].on_path;
    if (!last && level(bins[i]) == level(bins[i + 1])) continue;
    if (!last) points.push_back(place(bins[i + 1]));
    svg.polyline(points, picture::shade(static_cast<double>(level(bins[i])) / 15), 1.2);
    points.clear();
  }
}

/// How many samples lie in which part of the tolerance, as bars of their share.
void draw_bars(Svg& svg, const DeviationHistogram& histogram, const std::string& title, double left) {
  std::uint64_t all = 0, most = 0;
  for (const std::uint64_t count : histogram) {
    all += count;
    most = std::max(most, count);
  }
  const picture::Box box{left, kRunTop, kDeviationSide, 200};
  if (all == 0) {
    svg.text(left, kRunTop - 7, title + ": nothing to judge");
    return svg.frame(box);
  }
  const auto percent = [&](std::uint64_t count) {
    return 100 * static_cast<double>(count) / static_cast<double>(all);
  };
  const double last =
      100.0 * static_cast<double>(histogram.size()) / static_cast<double>(histogram.size() - 1);
  const Axes axes(box, {0, last}, {0, 1.05 * percent(most)});
  axes.draw(svg, "deviation, % of the tolerance; last bar: more", title + ": share of the samples, %");
  const double width = box.width / static_cast<double>(histogram.size());
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    const double y = axes.at(0, percent(histogram[i])).y;
    svg.fill({left + width * static_cast<double>(i) + 1, y, width - 1, box.bottom() - y},
             kLineColours[i + 1 == histogram.size() ? 1 : 0]);
  }
}

}  // namespace

std::string speed_picture(const Machine& machine, const std::vector<RunBin>& bins) {
  Svg svg = begin(kPanelsEnd + 10, "Motion of the tip; the colour names the joint at a limit");
  draw_key(svg, machine, true);
  int index = 0;
  const auto add = [&](const char* label, auto value) {
    const Axes axes = panel(bins, index, picture::round_up(largest(bins, value)));
    axes.draw(svg, time_label(index++), label);
    draw_curve(svg, axes, bins, value, colour_of);
  };
  add("speed, mm/s", [](const RunBin& b) { return b.speed_mm_s; });
  add("acceleration along the path, mm/s²", [](const RunBin& b) { return b.acceleration_mm_s2; });
  add("jerk along the path, mm/s³", [](const RunBin& b) { return b.jerk_mm_s3; });
  return svg.str();
}

std::string joint_picture(const Machine& machine, const std::vector<RunBin>& all,
                          const SimulationResult& result) {
  const std::vector<RunBin> bins = thinned(all, 1000);
  Svg svg = begin(kPanelsEnd + 50 + 22 * static_cast<double>(machine.joints.size()),
                  "What the joints use of their limits");
  draw_key(svg, machine, false);
  int index = 0;
  const auto add = [&](const char* label, auto member) {
    const Axes axes = panel(bins, index, 1.02);
    axes.draw(svg, time_label(index++), label);
    for (std::size_t i = 0; i < machine.joints.size(); ++i)
      draw_curve(
          svg, axes, bins, [&](const RunBin& b) { return std::min((b.*member)[i], 1.02F); },
          [&](const RunBin&) { return kLineColours[i]; });
  };
  add("velocity, share of the limit", &RunBin::velocity);
  add("acceleration, share of the limit", &RunBin::acceleration);
  add("jerk, share of the limit", &RunBin::jerk);
  draw_usage(svg, machine, result, kPanelsEnd + 40);
  return svg.str();
}

std::string path_picture(const std::vector<RunBin>& bins) {
  constexpr double kSide = 405;
  Svg svg = begin(kRunTop + kSide + 50, "The tip's way in the work, coloured by speed");
  draw_projection(svg, bins, kX, kY, kRunLeft, kSide);
  draw_projection(svg, bins, kX, kZ, kRunWidth - kRunRight - kSide, kSide);
  const double fastest = largest(bins, [](const RunBin& b) { return b.speed_mm_s; });
  picture::draw_shades(svg, {kRunWidth - kRunRight - kSide, 20}, kSide, "0",
                       fmt::format("{:.4g} mm/s", fastest));
  return svg.str();
}

std::string deviation_picture(const DeviationReport& report) {
  Svg svg = begin(kRunTop + 250, "Deviation from the program");
  draw_bars(svg, report.tip_histogram, "tip", kRunLeft);
  draw_bars(svg, report.axis_histogram, "tool axis", kRunWidth - kRunRight - kDeviationSide);
  return svg.str();
}

void write_run_pictures(const std::string& folder, const std::string& program, const Machine& machine,
                        const std::vector<RunBin>& bins, const SimulationResult& result) {
  const std::filesystem::path path(folder);
  make_result_folder(folder);
  std::string html = fmt::format(
      "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'><title>{0}</title>\n<style>body{{"
      "font-family:sans-serif;max-width:1040px;margin:auto}}pre{{overflow:auto}}</style></head>\n<body>\n"
      "<h1>{0}</h1>\n<pre>{1}</pre>\n",
      picture::escaped(program), picture::escaped(run_summary(result, machine, program)));
  for (const auto& [name, drawn] : {std::pair{"speed", speed_picture(machine, bins)},
                                    {"joints", joint_picture(machine, bins, result)},
                                    {"path", path_picture(bins)},
                                    {"deviation", deviation_picture(result.deviation)}}) {
    write_text_file((path / fmt::format("{}.svg", name)).string(), drawn);
    html += drawn;
  }
  write_text_file((path / "report.html").string(), html + "</body></html>\n");
}

}  // namespace trn

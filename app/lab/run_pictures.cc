#include "app/lab/run_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "app/lab/run_report.h"

namespace trn {

namespace {

constexpr double kWidth = 1000, kLeft = 80, kRight = 20, kPanel = 150, kGap = 34, kTop = 50;
constexpr float kAtLimit = 0.95F;  // as in the summary
constexpr const char* kFree = "#b0b0b0";
constexpr std::array<const char*, kMaxJoints> kColours{"#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee",
                                                       "#aa3377", "#995500", "#000000", "#8855ff"};

const char* colour_of(const RunBin& bin) {
  return bin.worst >= kAtLimit && bin.worst_joint >= 0 ? kColours[static_cast<std::size_t>(bin.worst_joint)]
                                                       : kFree;
}

/// Dark blue over green to yellow: monotone in lightness.
std::string shade(double share) {
  static constexpr std::array<std::array<double, 3>, 5> kStops{
      {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};
  const double at = std::clamp(share, 0.0, 1.0) * 4;
  const std::size_t i = std::min<std::size_t>(static_cast<std::size_t>(at), 3);
  std::array<long, 3> c{};
  for (std::size_t k = 0; k < 3; ++k)
    c[k] = std::lround(kStops[i][k] + (at - static_cast<double>(i)) * (kStops[i + 1][k] - kStops[i][k]));
  return fmt::format("#{:02x}{:02x}{:02x}", c[0], c[1], c[2]);
}

std::string text(double x, double y, const std::string& what, const char* more = "") {
  return fmt::format("<text x='{:.1f}' y='{:.1f}' {}>{}</text>\n", x, y, more, what);
}

std::string begin(double width, double height, const std::string& title) {
  return fmt::format(
             "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {0:g} {1:g}' width='{0:g}' "
             "font-family='sans-serif' font-size='12'>\n<rect width='{0:g}' height='{1:g}' fill='white'/>\n",
             width, height) +
         text(kLeft, 20, title, "font-size='15'");
}

/// 1, 2 or 5 times a power of ten, at least `value`.
double round_up(double value) {
  if (!(value > 0)) return 1;
  const double ten = std::pow(10, std::floor(std::log10(value)));
  for (const double step : {1.0, 2.0, 5.0})
    if (step * ten >= value * (1 - 1e-9)) return step * ten;
  return 10 * ten;
}

/// A chart over time, one under the other.
struct Panel {
  double top = 0, t_max = 1, y_max = 1;
  double x(double t) const { return kLeft + (kWidth - kLeft - kRight) * t / t_max; }
  double y(double value) const { return top + kPanel * (1 - std::clamp(value / y_max, 0.0, 1.02)); }
  std::string frame(const std::string& title) const {
    std::string out = text(kLeft, top - 6, title);
    for (const double share : {0.0, 0.5, 1.0}) {
      out += fmt::format("<path d='M{:g} {:.1f}H{:g}' stroke='#ddd'/>\n", kLeft, y(share * y_max),
                         kWidth - kRight);
      out += text(kLeft - 6, y(share * y_max) + 4, fmt::format("{:g}", share * y_max), "text-anchor='end'");
    }
    return out;
  }
  std::string seconds() const {
    std::string out;
    const double step = round_up(t_max / 10);
    for (double t = 0; t <= t_max * (1 + 1e-9); t += step)
      out += text(x(t), top + kPanel + 16, fmt::format("{:g} s", t), "text-anchor='middle'");
    return out;
  }
};

std::string polyline(const std::string& points, const std::string& colour, double width = 1.3) {
  return fmt::format("<polyline points='{}' fill='none' stroke='{}' stroke-width='{:g}'/>\n", points, colour,
                     width);
}

/// Value over time; a new line where the colour changes.
template <typename Value, typename Colour>
std::string curve(const Panel& panel, const std::vector<RunBin>& bins, Value value, Colour colour) {
  std::string out, points;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    points += fmt::format("{:.1f},{:.1f} ", panel.x(bins[i].t_s), panel.y(value(bins[i])));
    const bool last = i + 1 == bins.size();
    if (!last && std::string_view(colour(bins[i])) == colour(bins[i + 1])) continue;
    if (!last) points += fmt::format("{:.1f},{:.1f}", panel.x(bins[i + 1].t_s), panel.y(value(bins[i + 1])));
    out += polyline(points, colour(bins[i]));
    points.clear();
  }
  return out;
}

std::string key(const Machine& machine, double y, bool with_free) {
  std::string out;
  double x = kLeft;
  const auto entry = [&](const std::string& name, const char* colour) {
    out += fmt::format("<rect x='{:.0f}' y='{:.0f}' width='14' height='10' fill='{}'/>\n", x, y - 9, colour);
    out += text(x + 18, y, name);
    x += 30 + 8 * static_cast<double>(name.size());
  };
  for (std::size_t i = 0; i < machine.joints.size(); ++i) entry(machine.joints[i].name, kColours[i]);
  if (with_free) entry("no joint: the feed, or the way there and back", kFree);
  return out;
}

template <typename Value>
double largest(const std::vector<RunBin>& bins, Value value) {
  double out = 0;
  for (const RunBin& bin : bins) out = std::max<double>(out, value(bin));
  return out;
}

double end_s(const std::vector<RunBin>& bins) { return bins.empty() ? 1 : std::max(bins.back().t_s, 1e-3); }

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

std::string usage_bars(const Machine& machine, const SimulationResult& result, double top) {
  std::string out = text(
      kLeft, top - 6, "time at 95 % of a limit or more: velocity, acceleration, jerk; % of the cycle time");
  const double all = std::max(result.cycle_time_s, 1e-9), scale = (kWidth - kLeft - kRight) / 100;
  for (std::size_t i = 0; i < machine.joints.size(); ++i) {
    const double y = top + 22 * static_cast<double>(i);
    const TimeAtLimit& at = result.at_limit[i];
    out += text(kLeft - 6, y + 13, machine.joints[i].name, "text-anchor='end'");
    double x = kLeft;
    for (const auto& [time_s, opacity] :
         {std::pair{at.velocity, 1.0}, {at.acceleration, 0.65}, {at.jerk, 0.35}}) {
      const double width = std::min(100 * time_s / all * scale, kWidth - kRight - x);
      out += fmt::format(
          "<rect x='{:.1f}' y='{:.1f}' width='{:.1f}' height='16' fill='{}' fill-opacity='{:g}'/>\n", x, y,
          width, kColours[i], opacity);
      x += width;
    }
    out += text(x + 6, y + 13,
                fmt::format("{:.1f}, {:.1f}, {:.1f}", 100 * at.velocity / all, 100 * at.acceleration / all,
                            100 * at.jerk / all));
  }
  return out;
}

/// The way seen along one axis, in a square, in sixteen shades of speed.
std::string projection(const std::vector<RunBin>& bins, int right, int up, double left, double side) {
  Eigen::Vector2d low(1e30, 1e30), high(-1e30, -1e30);
  for (const RunBin& bin : bins)
    if (bin.on_path) {
      low = low.cwiseMin(Eigen::Vector2d(bin.p_W[right], bin.p_W[up]));
      high = high.cwiseMax(Eigen::Vector2d(bin.p_W[right], bin.p_W[up]));
    }
  const double range = std::max((high - low).maxCoeff(), 1e-6);
  const double fastest = std::max(largest(bins, [](const RunBin& b) { return b.speed_mm_s; }), 1e-9);
  const auto level = [&](const RunBin& b) { return std::lround(15 * b.speed_mm_s / fastest); };
  const auto place = [&](const RunBin& b) {
    return fmt::format("{:.1f},{:.1f} ", left + side * (b.p_W[right] - low[0]) / range,
                       kTop + side - side * (b.p_W[up] - low[1]) / range);
  };
  std::string out, points;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    if (!bins[i].on_path) continue;
    points += place(bins[i]);
    const bool last = i + 1 == bins.size() || !bins[i + 1].on_path;
    if (!last && level(bins[i]) == level(bins[i + 1])) continue;
    if (!last) points += place(bins[i + 1]);
    out += polyline(points, shade(static_cast<double>(level(bins[i])) / 15), 1);
    points.clear();
  }
  return out + text(left, kTop + side + 18,
                    fmt::format("{} to the right, {} up; {:.4g} mm wide", "XYZ"[right], "XYZ"[up], range));
}

std::string bars(const DeviationHistogram& histogram, const std::string& title, double left) {
  constexpr double kSide = 400;
  std::uint64_t sum = 0, most = 1;
  for (const std::uint64_t count : histogram) {
    sum += count;
    most = std::max(most, count);
  }
  std::string out = text(left, kTop - 8, fmt::format("{}; {} periods", title, sum));
  const double width = kSide / static_cast<double>(histogram.size());
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    const double height = 200.0 * static_cast<double>(histogram[i]) / static_cast<double>(most);
    out += fmt::format("<rect x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}' fill='{}'/>\n",
                       left + width * static_cast<double>(i), kTop + 200 - height, width - 1, height,
                       i + 1 == histogram.size() ? "#ee6677" : "#4477aa");
  }
  for (int k = 0; k <= 4; ++k)
    out += text(left + width * 5 * k, kTop + 216, fmt::format("{} %", 25 * k), "text-anchor='middle'");
  return out + text(left + kSide, kTop + 232, "of the tolerance; last bar: more", "text-anchor='end'");
}

void write_file(const std::filesystem::path& file, const std::string& what) {
  std::ofstream out(file);
  out << what;
  if (!out.flush()) throw std::runtime_error(fmt::format("{}: cannot write", file.string()));
}

std::string escaped(const std::string& raw) {
  std::string out;
  for (const char c : raw) out += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
  return out;
}

}  // namespace

std::string speed_picture(const Machine& machine, const std::vector<RunBin>& bins) {
  const double height = kTop + 3 * (kPanel + kGap) + 40;
  std::string out = begin(kWidth, height, "Motion of the tip; the colour names the joint at a limit");
  Panel panel{kTop, end_s(bins), 1};
  const auto add = [&](const char* title, auto value) {
    panel.y_max = round_up(largest(bins, value));
    out += panel.frame(title) + curve(panel, bins, value, colour_of);
    panel.top += kPanel + kGap;
  };
  add("speed, mm/s", [](const RunBin& b) { return b.speed_mm_s; });
  add("acceleration along the path, mm/s²", [](const RunBin& b) { return b.acceleration_mm_s2; });
  add("jerk along the path, mm/s³", [](const RunBin& b) { return b.jerk_mm_s3; });
  panel.top -= kPanel + kGap;
  return out + panel.seconds() + key(machine, height - 10, true) + "</svg>\n";
}

std::string joint_picture(const Machine& machine, const std::vector<RunBin>& all,
                          const SimulationResult& result) {
  const std::vector<RunBin> bins = thinned(all, 1000);
  const double bars_top = kTop + 3 * (kPanel + kGap) + 30;
  const double height = bars_top + 22 * static_cast<double>(machine.joints.size()) + 40;
  std::string out = begin(kWidth, height, "What the joints use of their limits");
  Panel panel{kTop, end_s(bins), 1};
  const auto add = [&](const char* title, auto member) {
    out += panel.frame(title);
    for (std::size_t i = 0; i < machine.joints.size(); ++i)
      out += curve(
          panel, bins, [&](const RunBin& b) { return (b.*member)[i]; },
          [&](const RunBin&) { return kColours[i]; });
    panel.top += kPanel + kGap;
  };
  add("velocity, of the limit", &RunBin::velocity);
  add("acceleration, of the limit", &RunBin::acceleration);
  add("jerk, of the limit", &RunBin::jerk);
  panel.top -= kPanel + kGap;
  return out + panel.seconds() + usage_bars(machine, result, bars_top) + key(machine, height - 10, false) +
         "</svg>\n";
}

std::string path_picture(const std::vector<RunBin>& bins) {
  constexpr double kSide = 440;
  std::string out = begin(kWidth, kTop + kSide + 70, "The tip's way in the work, coloured by speed");
  out += projection(bins, kX, kY, kLeft / 2, kSide) + projection(bins, kX, kZ, kWidth / 2 + 20, kSide);
  const double fastest = largest(bins, [](const RunBin& b) { return b.speed_mm_s; });
  for (int k = 0; k < 16; ++k)
    out += fmt::format("<rect x='{:.1f}' y='{:.1f}' width='13' height='10' fill='{}'/>\n", kLeft / 2 + 13 * k,
                       kTop + kSide + 36, shade(k / 15.0));
  return out + text(kLeft / 2 + 220, kTop + kSide + 46, fmt::format("0 to {:.4g} mm/s", fastest)) +
         "</svg>\n";
}

std::string deviation_picture(const DeviationReport& report) {
  std::string out = begin(kWidth, kTop + 250, "Deviation from the program");
  return out + bars(report.tip_histogram, "tip", kLeft) +
         bars(report.axis_histogram, "tool axis", kWidth / 2 + 40) + "</svg>\n";
}

void write_run_pictures(const std::string& folder, const std::string& program, const Machine& machine,
                        const std::vector<RunBin>& bins, const SimulationResult& result) {
  const std::filesystem::path path(folder);
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) throw std::runtime_error(fmt::format("{}: {}", folder, error.message()));
  std::string html = fmt::format(
      "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'><title>{0}</title>\n<style>body{{"
      "font-family:sans-serif;max-width:1040px;margin:auto}}pre{{overflow:auto}}</style></head>\n<body>\n"
      "<h1>{0}</h1>\n<pre>{1}</pre>\n",
      escaped(program), escaped(run_summary(result, machine, program)));
  for (const auto& [name, picture] : {std::pair{"speed", speed_picture(machine, bins)},
                                      {"joints", joint_picture(machine, bins, result)},
                                      {"path", path_picture(bins)},
                                      {"deviation", deviation_picture(result.deviation)}}) {
    write_file(path / fmt::format("{}.svg", name), picture);
    html += picture;
  }
  write_file(path / "report.html", html + "</body></html>\n");
}

}  // namespace trn

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/lab/workspace.h"
#include "core/units.h"

namespace trn {

namespace {

constexpr double kPanel = 230, kGap = 70, kLeft = 60, kTop = 90, kKeyHeight = 60;

/// What a column of the picture shows: a value of a grid column, negative for none.
struct Quantity {
  std::string title, unit;
  std::vector<double> values;  ///< by z, y, x
  double max = 0;
};

std::string colour(double share) {
  // dark blue over green to yellow: monotone in lightness, so that it survives a grey print
  static constexpr std::array<std::array<double, 3>, 5> kStops{
      {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};
  const double at = std::clamp(share, 0.0, 1.0) * 4;
  const std::size_t i = std::min<std::size_t>(static_cast<std::size_t>(at), 3);
  const double f = at - static_cast<double>(i);
  std::array<int, 3> c{};
  for (std::size_t k = 0; k < 3; ++k)
    c[k] = static_cast<int>(std::lround(kStops[i][k] + f * (kStops[i + 1][k] - kStops[i][k])));
  return fmt::format("#{:02x}{:02x}{:02x}", c[0], c[1], c[2]);
}

std::size_t places(const Workspace& w) {
  return static_cast<std::size_t>(w.count[0] * w.count[1] * w.count[2]);
}

/// The largest tilt of the survey that is reached there, deg.
Quantity tilt_reached(const Workspace& w) {
  Quantity out{"tilt reached", "deg", std::vector<double>(places(w), -1), 0};
  for (std::size_t i = 0; i < places(w); ++i)
    for (std::size_t tilt = 0; tilt < w.tilts_deg.size(); ++tilt) {
      if (w.values[tilt * places(w) + i].reach != Reach::kOk) break;
      out.values[i] = w.tilts_deg[tilt];
    }
  return out;
}

template <typename Get>
Quantity measured(const Workspace& w, std::size_t tilt, const char* title, const char* unit, Get get) {
  Quantity out{fmt::format("{}, tilt {:g} deg", title, w.tilts_deg[tilt]), unit, {}, 0};
  for (std::size_t i = 0; i < places(w); ++i) {
    const WorkspaceValue& v = w.values[tilt * places(w) + i];
    out.values.push_back(v.reach == Reach::kOk ? get(v) : -1);
  }
  return out;
}

/// The tilt at which stiffness and speeds are shown: the first above zero that the machine has anywhere.
std::size_t shown_tilt(const Workspace& w) {
  for (std::size_t tilt = 0; tilt < w.tilts_deg.size(); ++tilt)
    for (std::size_t i = 0; w.tilts_deg[tilt] > 0 && i < places(w); ++i)
      if (w.values[tilt * places(w) + i].reach == Reach::kOk) return tilt;
  return 0;
}

std::vector<Quantity> quantities(const Workspace& w) {
  const std::size_t tilt = shown_tilt(w);
  std::vector<Quantity> out{
      tilt_reached(w),
      measured(w, tilt, "conditioning", "of 1", [](const WorkspaceValue& v) { return v.conditioning; }),
      measured(w, tilt, "joint speed", "x tip speed", [](const WorkspaceValue& v) { return v.speed_gain; }),
      measured(w, tilt, "tool turn possible", "deg/s",
               [](const WorkspaceValue& v) { return deg_from_rad(v.turn_rad_s_max); })};
  for (Quantity& quantity : out)
    quantity.max = std::max(1e-9, *std::max_element(quantity.values.begin(), quantity.values.end()));
  return out;
}

/// One section: `across` and `up` are the axes in the picture, the third is at home.
std::string panel(const Workspace& w, const Quantity& quantity, int across, int up, double left, double top) {
  const int normal = 3 - across - up;
  std::array<int, 3> at{};
  at[static_cast<std::size_t>(normal)] =
      static_cast<int>(std::lround((w.home_B[normal] - w.min_B[normal]) / w.step_mm));
  const int columns = w.count[static_cast<std::size_t>(across)], rows = w.count[static_cast<std::size_t>(up)];
  const double cell = kPanel / std::max(columns, rows);
  std::string out;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      at[static_cast<std::size_t>(across)] = c;
      at[static_cast<std::size_t>(up)] = r;
      const double value = quantity.values[w.index(0, at[0], at[1], at[2])];
      if (value < 0) continue;
      out += fmt::format(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.2f}" height="{:.2f}" fill="{}"/>)"
                         "\n",
                         left + c * cell, top + (rows - 1 - r) * cell, cell + 0.2, cell + 0.2,
                         colour(value / quantity.max));
    }
  const double width = columns * cell, height = rows * cell;
  const Vec3 first = w.min_B, last = w.point(w.count[0] - 1, w.count[1] - 1, w.count[2] - 1);
  out += fmt::format(R"(<rect class="frame" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}"/>)"
                     "\n",
                     left, top, width, height);
  const double below = top + height + 14;
  out += fmt::format(
      R"(<text x="{:.1f}" y="{:.1f}">{:.0f}</text><text class="end" x="{:.1f}" y="{:.1f}">{:.0f}</text>)"
      R"(<text class="mid" x="{:.1f}" y="{:.1f}">{} mm</text>)"
      "\n",
      left, below, first[across], left + width, below, last[across], left + width / 2, below, "XYZ"[across]);
  out += fmt::format(
      R"(<text class="end" x="{0:.1f}" y="{1:.1f}">{2:.0f}</text><text class="end" x="{0:.1f}" y="{3:.1f}">{4:.0f}</text>)"
      R"(<text class="end" x="{0:.1f}" y="{5:.1f}">{6} mm</text>)"
      "\n",
      left - 5, top + height, first[up], top + 9, last[up], top + height / 2 + 4, "XYZ"[up]);
  return out;
}

/// The scale of a column: colours and what they stand for.
std::string key(const Quantity& quantity, double left, double top) {
  std::string out = fmt::format(R"(<text class="title" x="{:.1f}" y="{:.1f}">{}</text>)"
                                "\n",
                                left, top, quantity.title);
  constexpr int kSteps = 20;
  for (int i = 0; i < kSteps; ++i)
    out += fmt::format(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="8" fill="{}"/>)"
                       "\n",
                       left + i * 160.0 / kSteps, top + 8, 160.0 / kSteps + 0.2, colour((i + 0.5) / kSteps));
  out += fmt::format(R"(<text x="{:.1f}" y="{:.1f}">0</text><text x="{:.1f}" y="{:.1f}">{:.3g} {}</text>)"
                     "\n",
                     left, top + 28, left + 145, top + 28, quantity.max, quantity.unit);
  return out;
}

}  // namespace

std::string workspace_svg(const Workspace& w, const std::string& title) {
  const std::vector<Quantity> columns = quantities(w);
  const double width = kLeft + static_cast<double>(columns.size()) * (kPanel + kGap);
  const double height = kTop + kKeyHeight + 2 * (kPanel + kGap);
  std::string out = fmt::format(
      R"(<svg xmlns="http://www.w3.org/2000/svg" width="{0:.0f}" height="{1:.0f}" viewBox="0 0 {0:.0f} {1:.0f}">)"
      "\n<style>text{{font:11px sans-serif}}.end{{text-anchor:end}}.mid{{text-anchor:middle}}"
      ".title{{font-weight:bold}}.head{{font-size:16px}}.frame{{fill:none;stroke:#888}}rect{{shape-rendering:"
      "crispEdges}}</style>\n"
      R"(<rect width="100%" height="100%" fill="white"/>)"
      "\n"
      R"(<text class="head" x="{2:.0f}" y="28">{3}</text><text x="{2:.0f}" y="48">tip in the table frame; sections )"
      R"(through home ({4:.0f}, {5:.0f}, {6:.0f}); white: not reached</text>)"
      "\n",
      width, height, kLeft, title, w.home_B.x(), w.home_B.y(), w.home_B.z());
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const double left = kLeft + static_cast<double>(i) * (kPanel + kGap);
    out += key(columns[i], left, kTop - 10);
    out += panel(w, columns[i], 0, 1, left, kTop + kKeyHeight - 20);
    out += panel(w, columns[i], 0, 2, left, kTop + kKeyHeight - 20 + kPanel + kGap);
  }
  return out + "</svg>\n";
}

}  // namespace trn

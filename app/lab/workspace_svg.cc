#include "app/lab/workspace_svg.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "app/lab/picture/axes.h"
#include "app/lab/picture/svg.h"
#include "core/frames.h"
#include "core/units.h"

namespace trn {

namespace {

using picture::Svg;

constexpr double kMapPanel = 230, kGapX = 75, kGapY = 75, kMapLeft = 60, kMapTop = 150;

/// What a column of the picture shows: a value of a grid column, negative for none.
struct Shown {
  std::string title, unit;
  std::vector<double> values;  ///< by z, y, x
  double max = 0;
};

std::size_t places(const Workspace& w) {
  return static_cast<std::size_t>(w.count[0] * w.count[1] * w.count[2]);
}

/// The largest tilt of the survey that is reached there, deg.
Shown tilt_reached(const Workspace& w) {
  Shown out{"tilt reached", "deg", std::vector<double>(places(w), -1), 0};
  for (std::size_t i = 0; i < places(w); ++i)
    for (std::size_t tilt = 0; tilt < w.tilts_deg.size(); ++tilt) {
      if (w.values[tilt * places(w) + i].reach != Reach::kOk) break;
      out.values[i] = w.tilts_deg[tilt];
    }
  return out;
}

template <typename Get>
Shown measured(const Workspace& w, std::size_t tilt, const char* title, const char* unit, Get get) {
  Shown out{fmt::format("{}, tilt {:g} deg", title, w.tilts_deg[tilt]), unit, {}, 0};
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

std::vector<Shown> quantities(const Workspace& w) {
  const std::size_t tilt = shown_tilt(w);
  std::vector<Shown> out{
      tilt_reached(w),
      measured(w, tilt, "conditioning", "of 1", [](const WorkspaceValue& v) { return v.conditioning; }),
      measured(w, tilt, "joint speed", "times tip speed",
               [](const WorkspaceValue& v) { return v.speed_gain; }),
      measured(w, tilt, "tool turn possible", "deg/s",
               [](const WorkspaceValue& v) { return deg_from_rad(v.turn_rad_s_max); })};
  for (Shown& quantity : out)
    quantity.max = std::max(1e-9, *std::max_element(quantity.values.begin(), quantity.values.end()));
  return out;
}

/// Lowest and highest edge of the grid's cells along an axis, mm.
picture::Range edges(const Workspace& w, int axis) {
  const Vec3 last = w.point(w.count[0] - 1, w.count[1] - 1, w.count[2] - 1);
  return {w.min_B[axis] - w.step_mm / 2, last[axis] + w.step_mm / 2};
}

/// One section: `across` and `up` are the axes in the picture, the third is at home.
void draw_section(Svg& svg, const Workspace& w, const Shown& quantity, int across, int up, double left,
                  double top) {
  const int normal = 3 - across - up;
  std::array<int, 3> at{};
  at[static_cast<std::size_t>(normal)] =
      static_cast<int>(std::lround((w.home_B[normal] - w.min_B[normal]) / w.step_mm));
  const int columns = w.count[static_cast<std::size_t>(across)], rows = w.count[static_cast<std::size_t>(up)];
  const double cell = kMapPanel / std::max(columns, rows);
  const picture::Axes axes({left, top, cell * columns, cell * rows}, edges(w, across), edges(w, up));
  axes.draw(svg, fmt::format("{}, mm", "XYZ"[across]), fmt::format("{}, mm", "XYZ"[up]));
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      at[static_cast<std::size_t>(across)] = c;
      at[static_cast<std::size_t>(up)] = r;
      const double value = quantity.values[w.index(0, at[0], at[1], at[2])];
      if (value < 0) continue;
      // A little wider than the cell, so that no gap shows between two of them.
      svg.fill({left + c * cell, top + (rows - 1 - r) * cell, cell + 0.5, cell + 0.5},
               picture::shade(value / quantity.max));
    }
  svg.frame(axes.box());
}

}  // namespace

std::string workspace_svg(const Workspace& w, const std::string& title) {
  const std::vector<Shown> columns = quantities(w);
  constexpr double kEachX = kMapPanel + kGapX, kEachY = kMapPanel + kGapY;
  Svg svg(kMapLeft + static_cast<double>(columns.size()) * kEachX - kGapX + 25, kMapTop + 2 * kEachY);
  svg.text(kMapLeft, 28, title, {"start", 17});
  svg.text(
      kMapLeft, 48,
      fmt::format("tip in the table frame; sections through home ({:.0f}, {:.0f}, {:.0f}) mm; white: not "
                  "reached",
                  w.home_B.x(), w.home_B.y(), w.home_B.z()));
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const Shown& q = columns[i];
    const double left = kMapLeft + static_cast<double>(i) * kEachX;
    svg.text(left, kMapTop - 78, q.title, {"start", 12, true, kMapPanel + kGapX - 10});
    picture::draw_shades(svg, {left, kMapTop - 70}, kMapPanel, "0", fmt::format("{:.3g} {}", q.max, q.unit));
    draw_section(svg, w, q, 0, 1, left, kMapTop);
    draw_section(svg, w, q, 0, 2, left, kMapTop + kEachY);
  }
  return svg.str();
}

}  // namespace trn

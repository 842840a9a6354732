#include <cmath>
#include <limits>

#include "app/lab/micromill/experiment.h"
#include "app/lab/micromill/stage_lab.h"
#include "app/lab/picture/svg_chart.h"
#include "app/lab/text_file.h"
#include "compensation/micromill/deflection_correction.h"
#include "compensation/micromill/friction_network.h"
#include "core/units.h"
#include "sim/micromill/part_surface.h"

namespace trn {

namespace {

constexpr double kPeriodS = 0.001;
constexpr double kMagnified = 20;

struct Curve {
  std::vector<double> x, y;
  void add(double px, double py) {
    x.push_back(px);
    y.push_back(py);
  }
  /// The line is broken here.
  void gap() {
    if (!y.empty() && !std::isnan(y.back())) add(x.back(), std::numeric_limits<double>::quiet_NaN());
  }
};

// Force along one axis against time, estimate beside truth.
void draw_force(const std::string& path, const StageRun& run, int axis) {
  Curve estimate, truth;
  double smooth = 0;
  for (std::size_t i = 0; i < run.rows.size(); ++i) {
    const StageRow& row = run.rows[i];
    if (!row.counts) {
      estimate.gap();
      truth.gap();
      continue;
    }
    smooth +=
        0.05 * (row.true_force_N[axis] - smooth);  // the teeth's own rhythm is no part of the comparison
    const double t = static_cast<double>(i) * kPeriodS;
    estimate.add(t, row.force_N[axis]);
    truth.add(t, smooth);
  }
  picture::SvgChart chart(axis == 0 ? "Force on the tool along X" : "Force on the tool along Y", "time, s",
                          "force, N");
  chart.add("estimated", estimate.x, estimate.y);
  chart.add("true (mean of 20 ms)", truth.x, truth.y);
  chart.write(path);
}

// A closed contour whose distance from the nominal one is magnified.
Curve magnified(const StageRun& run) {
  Curve curve;
  for (const StageRow& row : run.rows) {
    if (!row.counts) {
      curve.gap();
      continue;
    }
    const Eigen::Vector2d place = row.plan_mm + kMagnified * row.deflection_mm;
    curve.add(place.x(), place.y());
  }
  return curve;
}

void draw_contour(const std::string& path, PartSurface::Shape shape, const StageRun& run) {
  Curve plan, surface;
  for (const StageRow& row : run.rows) row.counts ? plan.add(row.plan_mm.x(), row.plan_mm.y()) : plan.gap();
  const auto bins = static_cast<double>(run.surface_mm.size());
  for (std::size_t i = 0; i < run.surface_mm.size(); ++i) {
    const double angle = 2 * kPi * (static_cast<double>(i) + 0.5) / bins;
    const double c = std::cos(angle), s = std::sin(angle);
    const double unit = shape == PartSurface::Shape::kRound ? 1 : std::max(std::abs(c), std::abs(s));
    const double nominal = kPartSizeMm / 2;
    const double out = (nominal + kMagnified * (run.surface_mm[i] - nominal)) / unit;
    if (out > 1.5 * nominal) continue;  // the slot's own way in
    surface.add(out * c, out * s);
  }
  const Curve estimate = magnified(run);
  picture::SvgChart chart("Deflection along the contour, 20 times larger", "X, mm", "Y, mm");
  chart.set_square();
  chart.add("programmed path", plan.x, plan.y);
  chart.add("path with estimated deflection", estimate.x, estimate.y);
  chart.add("surface of the part", surface.x, surface.y);
  chart.write(path);
}

}  // namespace

void draw_part(const std::string& folder, PartSurface::Shape shape, const StageRun& run) {
  const std::string name = shape == PartSurface::Shape::kRound ? "round" : "square";
  make_result_folder(folder);
  draw_force(folder + "/force_x_" + name + ".svg", run, 0);
  draw_force(folder + "/force_y_" + name + ".svg", run, 1);
  draw_contour(folder + "/deflection_" + name + ".svg", shape, run);
}

void draw_validation(const std::string& folder, const StageLab& lab, const StageNetworks& networks) {
  make_result_folder(folder);
  const DeflectionCorrection::Config config = learnt(lab, networks, {1, 1}, 0);
  const StageRun run = lab.run(validation_program(), {}, &config);
  for (int axis = 0; axis < 2; ++axis) {
    Curve network, truth;
    for (const StageRow& row : run.rows) {
      if (!row.counts) {
        network.gap();
        truth.gap();
        continue;
      }
      network.add(row.plan_mm[axis], row.friction_N[axis]);
      truth.add(row.plan_mm[axis], row.true_disturbance_N[axis]);
    }
    const char* letter = axis == 0 ? "X" : "Y";
    picture::SvgChart chart(std::string("Friction and ripple of ") + letter + " on runs not learnt from",
                            "position, mm", "force, N");
    chart.add("true", truth.x, truth.y);
    chart.add("network", network.x, network.y);
    chart.write(folder + "/network_" + (axis == 0 ? "x" : "y") + ".svg");
  }
}

}  // namespace trn

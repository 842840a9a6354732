#include "sim/touch_shapes.h"

#include <algorithm>
#include <cmath>

#include "core/units.h"

namespace trn {

namespace {

// Of two half spaces that stand square to each other: their union's distance from outside both is that of the
// edge between them.
double meet(double a, double b) TRN_RT { return a > 0 && b > 0 ? std::hypot(a, b) : std::max(a, b); }

double distance_to(const TouchShapes::Plate& plate, const Vec3& p) TRN_RT {
  const Vec3 beyond = (plate.min - p).cwiseMax(p - plate.max);
  double d = beyond.maxCoeff() > 0 ? beyond.cwiseMax(0.0).norm() : beyond.maxCoeff();
  for (const TouchShapes::Bore& bore : plate.bores) {
    // Positive in the air of the bore: how far its wall is, or its bottom.
    const double wall = bore.radius - std::hypot(p.x() - bore.x, p.y() - bore.y);
    d = meet(d, std::min(wall, p.z() - bore.bottom));
  }
  return d;
}

double distance_to(const TouchShapes::Boss& boss, const Vec3& p) TRN_RT {
  const double half = boss.height / 2;
  return meet(std::hypot(p.x(), p.y()) - boss.radius, std::abs(p.z() + half) - half);
}

Pose read_pose(const ConfigTable& table) {
  const Vec3 turn = table.vec3("turn_deg", Vec3::Zero()) * kRadPerDeg;
  return {rot_z(turn.x()) * rot_x(turn.y()) * rot_z(turn.z()), table.vec3("at_mm", Vec3::Zero())};
}

TouchShapes::Bore read_bore(const ConfigTable& table, const TouchShapes::Plate& plate) {
  TouchShapes::Bore bore;
  bore.x = table.number("x_mm");
  bore.y = table.number("y_mm");
  bore.radius = table.number("diameter_mm", kPositive) / 2;
  if (table.has("depth_mm")) bore.bottom = plate.max.z() - table.number("depth_mm", kPositive);
  const Eigen::Vector2d at(bore.x, bore.y);
  const double room = std::min((at - plate.min.head<2>()).minCoeff(), (plate.max.head<2>() - at).minCoeff());
  if (room <= bore.radius)
    throw table.error("diameter_mm", "the bore must lie inside the sides of its plate");
  return bore;
}

TouchShapes::Plate read_plate(const ConfigTable& table) {
  TouchShapes::Plate plate{read_pose(table), table.vec3("min_mm"), table.vec3("max_mm")};
  if ((plate.max - plate.min).minCoeff() <= 0)
    throw table.error("max_mm", "every coordinate must be greater than that of min_mm");
  for (const ConfigTable& bore : table.tables_if("bore")) plate.bores.push_back(read_bore(bore, plate));
  return plate;
}

}  // namespace

double distance(const TouchShapes& shapes, const Vec3& p_M) TRN_RT {
  double nearest = std::numeric_limits<double>::infinity();
  for (const TouchShapes::Plate& plate : shapes.plates)
    nearest = std::min(nearest, distance_to(plate, plate.X_MS.R.transpose() * (p_M - plate.X_MS.p)));
  for (const TouchShapes::Boss& boss : shapes.bosses)
    nearest = std::min(nearest, distance_to(boss, boss.X_MS.R.transpose() * (p_M - boss.X_MS.p)));
  for (const TouchShapes::Ball& ball : shapes.balls)
    nearest = std::min(nearest, (p_M - ball.centre).norm() - ball.radius);
  return nearest;
}

TouchShapes read_touch_shapes(const ConfigTable& table) {
  TouchShapes shapes;
  for (const ConfigTable& entry : table.tables_if("plate")) shapes.plates.push_back(read_plate(entry));
  for (const ConfigTable& entry : table.tables_if("boss"))
    shapes.bosses.push_back(
        {read_pose(entry), entry.number("diameter_mm", kPositive) / 2, entry.number("height_mm", kPositive)});
  for (const ConfigTable& entry : table.tables_if("ball"))
    shapes.balls.push_back({entry.vec3("at_mm"), entry.number("diameter_mm", kPositive) / 2});
  return shapes;
}

}  // namespace trn

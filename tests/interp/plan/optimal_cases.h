#pragma once

#include <string>

#include "core/axes.h"
#include "core/path.h"
#include "core/ports.h"
#include "tests/interp/plan/speed_support.h"

// Stretches with certified optimal times. An independent solver computed the times once, from the files that
// stretch_export_test writes (tests/interp/plan/speed_reference.py runs it).
namespace trn::speed_test {

/// A stretch whose shortest time is known.
struct OptimalCase {
  std::string name;
  std::vector<PathPiece> pieces;
  Joints joints;
  const JointMap* map;
  double feed;
  double best_s;  ///< feasible optimum found by the reference
  double step = 0.02;
};

/// A sine in pieces of `size`, joined with three derivatives.
inline std::vector<PathPiece> sine(double amplitude, double wave, double length, double size) {
  const auto point = [&](double s) {
    PathPoint p;
    p.y = p.d1 = p.d2 = p.d3 = Words::Zero();
    const double w = 2 * kPi / wave;
    p.y << s, amplitude * std::sin(w * s), 0, 0, 0, 0;
    p.d1 << 1, amplitude * w * std::cos(w * s), 0, 0, 0, 0;
    p.d2 << 0, -amplitude * w * w * std::sin(w * s), 0, 0, 0, 0;
    p.d3 << 0, -amplitude * w * w * w * std::cos(w * s), 0, 0, 0, 0;
    return p;
  };
  std::vector<PathPiece> out;
  for (int i = 0; i < static_cast<int>(length / size + 0.5); ++i)
    out.push_back(make_hermite(point(i * size), point((i + 1) * size), size));
  return out;
}

inline std::vector<PathPiece> corner() {
  Words a = Words::Zero(), b = a, c = a;
  b[kX] = 50;
  c.head<2>() << 50, 50;
  return blended({a, b, c}, 0.12);
}

inline std::vector<PathPiece> polyline(unsigned seed, int count, double step, double turn, double reach) {
  std::mt19937_64 rng(seed);
  return blended(random_vertices(rng, count, step, turn), reach);
}

inline std::vector<OptimalCase> optimal_cases() {
  static const IdentityMap x({kX}), xy({kX, kY}), xyz({kX, kY, kZ});
  static const TrunnionMap trunnion;
  Words to = Words::Zero();
  to[kX] = 100;
  return {
      {"line", {make_line(Words::Zero(), to)}, linear_joints(1), &x, 200, 0.58949, 0.05},
      {"circle", circle(20, 1), linear_joints(2), &xy, 150, 0.91583},
      {"corner", corner(), linear_joints(2), &xy, 1e9, 0.50627, 0.005},
      {"sine", sine(3, 15, 60, 0.5), linear_joints(2), &xy, 300, 0.79971},
      {"polyline", polyline(21, 12, 5, 0, 0.5), linear_joints(3), &xyz, 150, 1.05495},
      {"five_axis", polyline(22, 12, 5, 0.08, 1.0), cradle_joints(), &trunnion, 100, 1.9245},
      {"five_axis_short", polyline(23, 60, 0.5, 0.004, 0.2), cradle_joints(), &trunnion, 100, 2.93637},
  };
}

}  // namespace trn::speed_test

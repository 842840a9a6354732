#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/path.h"
#include "interp/move.h"
#include "interp/plan/geometry/geometry_planner.h"
#include "interp/plan/stages.h"

// What the geometry tests share: a receiver, and judges of continuity and deviation that know only the moves.
namespace trn::geometry_check {

struct Collector : PieceSink {
  struct Event {
    size_t after;  ///< pieces received before it
    QueueEvent event;
    std::uint32_t line;
  };
  std::vector<PlanPiece> pieces;
  std::vector<Event> events;
  void piece(const PlanPiece& p) override { pieces.push_back(p); }
  void event(const QueueEvent& e, SourceLine source) override {
    events.push_back({pieces.size(), e, source.line});
  }
};

inline Words words(double x, double y, double z = 0, double a = 0, double b = 0, double c = 0) {
  Words w;
  w << x, y, z, a, b, c;
  return w;
}

inline ProgramMove line_move(const Words& from, const Words& to, double tol_mm = 0.05,
                             double tol_rad = 0.01) {
  ProgramMove m;
  m.kind = ProgramMove::Kind::kFeed;
  m.from = from;
  m.to = to;
  m.arc_centre.setZero();
  m.arc_axis.setZero();
  m.feed.tip_mm_s = 50;
  m.tolerance_mm = tol_mm;
  m.tolerance_rad = tol_rad;
  return m;
}

inline ProgramMove arc_move(const Words& from, const Words& to, const Vec3& centre, double sweep,
                            double tol_mm = 0.05) {
  ProgramMove m = line_move(from, to, tol_mm);
  m.kind = ProgramMove::Kind::kArc;
  m.arc_centre = centre;
  m.arc_axis = Vec3(0, 0, 1);
  m.arc_sweep_rad = sweep;
  return m;
}

/// Moves along the points, lines numbered from 1.
inline std::vector<ProgramMove> polyline(const std::vector<Words>& points, double tol_mm = 0.05,
                                         double tol_rad = 0.01) {
  std::vector<ProgramMove> moves;
  for (size_t i = 1; i < points.size(); ++i) {
    moves.push_back(line_move(points[i - 1], points[i], tol_mm, tol_rad));
    moves.back().source.line = static_cast<std::uint32_t>(i);
  }
  return moves;
}

inline std::vector<PlanPiece> plan(const std::vector<ProgramMove>& moves,
                                   const GeometryOptions& options = {}) {
  Collector out;
  GeometryPlanner planner(options, out);
  for (const auto& m : moves) planner.move(m);
  planner.finish();
  return out.pieces;
}

/// The programmed place of a move at u in [0, 1], from first principles.
inline Words programmed(const ProgramMove& m, double u) {
  Words y = m.from + (m.to - m.from) * u;
  if (m.kind != ProgramMove::Kind::kArc) return y;
  const Vec3 r = m.from.head<3>() - m.arc_centre, n = m.arc_axis;
  const double t = m.arc_sweep_rad * u;
  const Vec3 turned = r * std::cos(t) + n.cross(r) * std::sin(t) + n * n.dot(r) * (1 - std::cos(t));
  const Vec3 end = r * std::cos(m.arc_sweep_rad) + n.cross(r) * std::sin(m.arc_sweep_rad) +
                   n * n.dot(r) * (1 - std::cos(m.arc_sweep_rad));
  y.head<3>() = m.arc_centre + turned + u * (m.to.head<3>() - m.arc_centre - end);
  return y;
}

/// Deviation over tolerance of y from move m: least over the move of the worse of position and orientation.
inline double usage_of(const ProgramMove& m, const Words& y) {
  const auto f = [&](double u) {
    const Words e = y - programmed(m, u);
    const double p = e.head<3>().norm(), r = e.tail<3>().norm();
    return std::max(p < 1e-12 ? 0 : p / m.tolerance_mm, r < 1e-12 ? 0 : r / m.tolerance_rad);
  };
  const int n = m.kind == ProgramMove::Kind::kArc ? 400 : 8;
  double best = 0, value = f(0);
  for (int k = 1; k <= n; ++k)
    if (const double v = f(1.0 * k / n); v < value) value = v, best = 1.0 * k / n;
  double lo = std::max(0.0, best - 1.0 / n), hi = std::min(1.0, best + 1.0 / n);
  for (int k = 0; k < 60; ++k) {
    const double a = lo + (hi - lo) * 0.382, b = lo + (hi - lo) * 0.618;
    (f(a) < f(b) ? hi : lo) = f(a) < f(b) ? b : a;
  }
  return std::min(value, f((lo + hi) / 2));
}

/// Worst deviation over tolerance of all pieces; each is compared with the moves around its line (index line
/// - 1).
inline double worst_usage(const std::vector<ProgramMove>& moves, const std::vector<PlanPiece>& pieces,
                          int samples = 16, int around = 2) {
  double worst = 0;
  for (const auto& p : pieces)
    for (int k = 0; k <= samples; ++k) {
      const Words y = p.piece.at(p.piece.length * k / samples);
      double best = 1e300;
      const int i = static_cast<int>(p.source.line) - 1;
      for (int d = 0; d <= around && best > 0.5; ++d)
        for (int j : {i - d, i + d})
          if (j >= 0 && j < static_cast<int>(moves.size()))
            best = std::min(best, usage_of(moves[static_cast<size_t>(j)], y));
      worst = std::max(worst, best);
    }
  return worst;
}

/// The same for pieces that stand for many moves: each is compared with the moves from its line to the next
/// piece's. Lines only. The nearest place by the path norm is tried first, the least usage where that is not
/// good enough.
inline double worst_usage_of_runs(const std::vector<ProgramMove>& moves, const std::vector<PlanPiece>& pieces,
                                  int samples = 16) {
  constexpr int kMargin = 3;
  const int n = static_cast<int>(moves.size());
  const auto nearest = [](const ProgramMove& m, const Words& y) {
    const Words e = m.to - m.from;
    const double length2 = path_dot(e, e);
    const double t = length2 > 0 ? std::clamp(path_dot(y - m.from, e) / length2, 0.0, 1.0) : 0;
    const Words miss = y - m.from - t * e;
    const double r = miss.tail<3>().norm();
    return std::max(miss.head<3>().norm() / m.tolerance_mm, r < 1e-12 ? 0 : r / m.tolerance_rad);
  };
  double worst = 0;
  for (size_t i = 0; i < pieces.size(); ++i) {
    const int from = std::max(0, static_cast<int>(pieces[i > 1 ? i - 2 : 0].source.line) - 1 - kMargin);
    const int next = i + 2 < pieces.size() ? static_cast<int>(pieces[i + 2].source.line) : n;
    const int to = std::min(n - 1, next - 1 + kMargin), parts = std::max(samples, 2 * (to - from));
    for (int k = 0; k <= parts; ++k) {
      const Words y = pieces[i].piece.at(pieces[i].piece.length * k / parts);
      double best = 1e300;
      for (int j = from; j <= to; ++j) best = std::min(best, nearest(moves[static_cast<size_t>(j)], y));
      for (int j = from; j <= to && best > 0.99; ++j)
        best = std::min(best, usage_of(moves[static_cast<size_t>(j)], y));
      worst = std::max(worst, best);
    }
  }
  return worst;
}

/// Neighbours of a stretch join with three derivatives: the value to 1e-12, derivative n to what rounding of
/// the value leaves after n divisions by the piece's length. Between stretches the value alone.
inline void expect_continuous(const std::vector<PlanPiece>& pieces) {
  for (size_t i = 1; i < pieces.size(); ++i) {
    const PathPiece &a = pieces[i - 1].piece, &b = pieces[i].piece;
    ASSERT_GT(a.length, 0);
    const PathPoint p = a.derivatives(a.length), q = b.derivatives(0);
    const double eps = 1e-12 * (1 + p.y.norm() / 100);
    ASSERT_LT((p.y - q.y).norm(), eps) << "piece " << i << " line " << pieces[i].source.line;
    if (pieces[i - 1].ends_stretch) continue;
    const double h = std::min({a.length, b.length, 1.0});
    ASSERT_LT((p.d1 - q.d1).norm(), 20 * eps / h) << "piece " << i << " line " << pieces[i].source.line;
    ASSERT_LT((p.d2 - q.d2).norm(), 400 * eps / (h * h))
        << "piece " << i << " line " << pieces[i].source.line;
    ASSERT_LT((p.d3 - q.d3).norm(), 8000 * eps / (h * h * h))
        << "piece " << i << " line " << pieces[i].source.line;
  }
}

inline size_t stretches(const std::vector<PlanPiece>& pieces) {
  size_t n = 0;
  for (const auto& p : pieces) n += p.ends_stretch;
  return n;
}

}  // namespace trn::geometry_check

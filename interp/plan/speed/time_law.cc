#include "interp/plan/speed/time_law.h"

#include <algorithm>
#include <cmath>

namespace trn::speed {

namespace {

constexpr double kJerkToCorrect = 0.2;  // share of the jerk that a change of the correction may take
constexpr double kCorrection = 0.5;     // of the speed's deviation taken back at the next node

// Time to cover h from v with acceleration running linearly from a0 to a1: h = v T + (2 a0 + a1) T^2 / 6.
double crossing_time(double h, double v, double a0, double a1) {
  const double root = v * v + 2.0 / 3.0 * h * (2 * a0 + a1);
  return root > 0 ? 2 * h / (v + std::sqrt(root)) : -1;
}

// v^2 at the end of the interval, whose acceleration there is a1.
double end_b(double h, const PathState& from, double a1) {
  const double T = crossing_time(h, from.v, from.a, a1);
  const double v = from.v + T * (from.a + a1) / 2;
  return T > 0 ? v * v : from.v * from.v + h * (from.a + a1);
}

// Acceleration at the end of the interval for which the constant-jerk stop over rest_length fits exactly.
double stopping_acceleration(double h, const PathState& from, double a1, double rest_length) {
  for (int i = 0; i < 30; ++i) {  // contraction: a1 changes v1 by T/2 only
    const double T = crossing_time(h, from.v, from.a, a1);
    if (T < 0) return a1;
    const double v1 = from.v + T * (from.a + a1) / 2;
    const double error = a1 + 2.0 / 3.0 * v1 * v1 / rest_length;
    a1 -= error / (1 + 2.0 / 3.0 * v1 * T / rest_length);
  }
  return a1;
}

}  // namespace

double LawSegment::time_at(double s) const { return time_at(s, 1e-12); }

double LawSegment::time_at(double s, double accuracy) const {
  const double reached = from.v * from.v + 2 * from.a * (s - from.s);  // (ds/dt)^2 there, without jerk
  double low = 0, high = duration_s, t = high / 2;
  if (reached > 0) t = std::min(2 * (s - from.s) / (from.v + std::sqrt(reached)), high);
  for (int i = 0; i < 60; ++i) {  // Newton, kept inside the bracket
    const PathState p = at(t);
    const double error = p.s - s;
    (error > 0 ? high : low) = t;
    const double next = p.v > 0 ? t - error / p.v : -1;
    if (std::abs(next - t) <= accuracy * duration_s)
      return std::clamp(next, 0.0, duration_s);  // then far closer
    t = next > low && next < high ? next : (low + high) / 2;
  }
  return t;
}

bool make_time_law(const std::deque<GridInterval>& grid, size_t first, const SpeedProblem& problem,
                   const Doubles& c, PathState from, double rest_length, std::vector<LawSegment>& law) {
  const size_t n = problem.intervals;
  double correction = from.a - problem.at_node(c, 0).a;
  for (size_t k = 0; k < n; ++k) {
    const GridInterval& g = grid[first + k];
    const double s_next = g.s + g.h, h = s_next - from.s;
    const SpeedState target = problem.at_node(c, k + 1);
    const double wanted = kCorrection * (target.b - end_b(h, from, target.a)) / h;
    const double T_about = std::max(crossing_time(h, from.v, from.a, target.a), 0.0);
    const double change =
        kJerkToCorrect * g.bound.jerk * T_about;  // a short interval would need all the jerk
    correction = std::clamp(wanted, correction - change, correction + change);
    double a1 = target.a + correction;
    if (k + 1 == n) a1 = stopping_acceleration(h, from, a1, rest_length);
    const double T = crossing_time(h, from.v, from.a, a1);
    LawSegment segment{from, (a1 - from.a) / T, T, first + k, first + k + 1};
    PathState end{s_next, from.v + T * (from.a + a1) / 2, a1};
    if (!(T > 0) || !(end.v > 0)) return false;
    law.push_back(segment);
    from = end;
  }
  return true;
}

LawSegment rest_start(const std::deque<GridInterval>& grid, size_t first, size_t last, double b_end) {
  const double s = grid[first].s, length = grid[last - 1].s + grid[last - 1].h - s, v = std::sqrt(b_end);
  const double T = 3 * length / v;
  return {{s, 0, 0}, 2 * v / (T * T), T, first, last};
}

LawSegment rest_stop(const std::deque<GridInterval>& grid, size_t first, size_t last, const PathState& from) {
  const double length = grid[last - 1].s + grid[last - 1].h - from.s, T = 3 * length / from.v;
  return {{from.s, from.v, -2 * from.v / T}, 2 * from.v / (T * T), T, first, last};
}

PathSample between(const PathSample* p, double s, int count) {
  const double a = s - p[0].s, b = s - p[1].s, c = s - p[2].s;
  const double ab = p[0].s - p[1].s, ac = p[0].s - p[2].s, bc = p[1].s - p[2].s;
  const double w0 = b * c / (ab * ac), w1 = -a * c / (ab * bc), w2 = a * b / (ac * bc);
  PathSample out;
  out.s = s;
  out.b_max = w0 * p[0].b_max + w1 * p[1].b_max + w2 * p[2].b_max;
  for (size_t j = 0; j < static_cast<size_t>(count); ++j) {
    out.d1[j] = w0 * p[0].d1[j] + w1 * p[1].d1[j] + w2 * p[2].d1[j];
    out.d2[j] = w0 * p[0].d2[j] + w1 * p[1].d2[j] + w2 * p[2].d2[j];
    out.d3[j] = w0 * p[0].d3[j] + w1 * p[1].d3[j] + w2 * p[2].d3[j];
  }
  return out;
}

}  // namespace trn::speed

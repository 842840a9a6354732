#include "interp/plan/speed/time_law.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace trn::speed {

namespace {

constexpr double kJerkToCorrect = 0.2;  // share of the jerk that a change of the correction may take
constexpr double kCorrection = 0.5;     // of the deviation of b, corrected by the next node
constexpr double kBraking = 0.8;        // of the greatest correction from which it comes back in time

// Time to cover h from v with the acceleration linear in time from a0 to a1: h = v T + (2 a0 + a1) T^2 / 6.
// The root is taken in the form that has no cancellation. Negative: the motion would turn back before h.
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

// The acceleration a1 at the end of the interval for which constant jerk leads to rest over rest_length: from
// rest backwards, s = jerk t^3 / 6 gives a = -2/3 v^2 / rest_length. v1 depends on a1, so this is one
// equation for a1, solved by Newton's method with dv1/da1 about T / 2.
double stopping_acceleration(double h, const PathState& from, double a1, double rest_length) {
  TRN_CHECK(h > 0 && rest_length > 0);
  for (int i = 0; i < 30; ++i) {
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
  for (int i = 0; i < 60; ++i) {  // Newton's method, or bisection where that leaves [low, high]
    const PathState p = at(t);
    const double error = p.s - s;
    (error > 0 ? high : low) = t;
    const double next = p.v > 0 ? t - error / p.v : -1;
    if (std::abs(next - t) <= accuracy * duration_s)
      return std::clamp(next, 0.0, duration_s);  // Newton's last step: its error is far less
    t = next > low && next < high ? next : (low + high) / 2;
  }
  return t;
}

// The solution's b is a parabola of s on an interval; constant jerk makes a linear in t instead, so v drifts
// from the solution's. The drift is taken back through the acceleration at the nodes. The correction changes
// slowly: a short interval beside a much longer one would need several times the jerk limit for it.
bool make_time_law(const std::deque<GridInterval>& grid, size_t first, const SpeedProblem& problem,
                   const Doubles& c, PathState from, double rest_length, std::vector<LawSegment>& law) {
  const size_t n = problem.intervals;
  double correction = from.a - problem.at_node(c, 0).a;
  for (size_t k = 0; k < n; ++k) {
    const GridInterval& g = grid[first + k];
    const double s_next = g.s + g.h, h = s_next - from.s;
    const SpeedState target = problem.at_node(c, k + 1);
    const double b_end = end_b(h, from, target.a), jerk = kJerkToCorrect * g.bound.jerk;
    const double T_about = std::max(crossing_time(h, from.v, from.a, target.a), 0.0);
    // At that jerk the correction comes back to 0 together with the deviation of v, as in braking to a place.
    const double most = kBraking * std::sqrt(2 * jerk * std::abs(std::sqrt(target.b) - std::sqrt(b_end)));
    const double wanted = std::clamp(kCorrection * (target.b - b_end) / h, -most, most);
    const double change = jerk * T_about;
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

// From rest at constant jerk: s = jerk T^3 / 6 and v = jerk T^2 / 2, hence T = 3 s / v.
LawSegment rest_start(const std::deque<GridInterval>& grid, size_t first, size_t last, double b_end) {
  const double s = grid[first].s, length = grid[last - 1].s + grid[last - 1].h - s, v = std::sqrt(b_end);
  const double T = 3 * length / v;
  return {{s, 0, 0}, 2 * v / (T * T), T, first, last};
}

LawSegment rest_stop(const std::deque<GridInterval>& grid, size_t first, size_t last, const PathState& from) {
  const double length = grid[last - 1].s + grid[last - 1].h - from.s, T = 3 * length / from.v;
  return {{from.s, from.v, -2 * from.v / T}, 2 * from.v / (T * T), T, first, last};
}

}  // namespace trn::speed

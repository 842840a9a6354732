#include "interp/plan/speed/speed_problem.h"

#include <algorithm>
#include <cmath>

namespace trn::speed {

namespace {

// The derivatives used at one end of an interval: those of the end's own sample, but the widest d3 of all
// samples of the interval, so that a peak inside is seen.
struct EndRow {
  double d1, d2, d3;
};

EndRow end_row(const GridInterval& g, size_t joint, bool right) {
  const PathSample& own = right ? g.samples.back() : g.samples.front();
  const PathSample& other = right ? g.samples.front() : g.samples.back();
  EndRow row{own.d1[joint], own.d2[joint], own.d3[joint]};
  const bool upper = own.d3[joint] > other.d3[joint] || (own.d3[joint] == other.d3[joint] && right);
  for (const PathSample& p : g.samples)
    row.d3 = upper ? std::max(row.d3, p.d3[joint]) : std::min(row.d3, p.d3[joint]);
  return row;
}

void set_nodes(const PlanEnd& start, const PlanEnd& end, SpeedProblem& p) {
  const size_t n = static_cast<size_t>(p.intervals);
  for (Doubles* v : {&p.node_b0, &p.node_b1, &p.node_a0, &p.node_a1}) v->assign(n + 1, 0);
  for (size_t k = 1; k < n; ++k) {
    const double sum = p.h[k - 1] + p.h[k];
    p.node_b0[k] = p.h[k] / sum;
    p.node_b1[k] = p.h[k - 1] / sum;
    p.node_a0[k] = -1 / sum;
    p.node_a1[k] = 1 / sum;
  }
  p.first_fixed = !start.at_rest;
  if (start.at_rest) {  // c = b + a h and a = 2/3 b / length
    const double rate = 2.0 / 3.0 / start.rest_length;
    p.node_b1[0] = 1 / (1 + rate * p.h[0]);
    p.node_a1[0] = rate * p.node_b1[0];
  } else {
    p.first_c = start.state.b + start.state.a * p.h[0];
    p.node_b1[0] = start.state.b / p.first_c;
    p.node_a1[0] = start.state.a / p.first_c;
  }
  const double rate = 2.0 / 3.0 / end.rest_length;
  p.node_b0[n] = 1 / (1 + rate * p.h[n - 1]);
  p.node_a0[n] = -rate * p.node_b0[n];
}

void set_acceleration_rows(const std::deque<GridInterval>& grid, size_t first, const JointRates& rates,
                           const std::deque<Headroom>& headroom, SpeedProblem& p) {
  const size_t n = static_cast<size_t>(p.intervals), stride = n + 1;
  p.acc0.assign(stride * static_cast<size_t>(p.joints), 0);
  p.acc1 = p.acc0;
  for (size_t k = p.first_fixed ? 1 : 0; k <= n; ++k) {
    const GridInterval& g = grid[first + std::min(k, n - 1)];
    const PathSample& at = k < n ? g.samples.front() : g.samples.back();
    double share = headroom[first + std::min(k, n - 1)].acceleration;
    if (k > 0) share = std::min(share, headroom[first + k - 1].acceleration);
    for (size_t j = 0; j < static_cast<size_t>(p.joints); ++j) {
      const double scale = 1 / (rates.acceleration[j] * share);
      p.acc0[j * stride + k] = scale * (at.d1[j] * p.node_a0[k] + at.d2[j] * p.node_b0[k]);
      p.acc1[j * stride + k] = scale * (at.d1[j] * p.node_a1[k] + at.d2[j] * p.node_b1[k]);
    }
  }
}

// Speeds on interval k of the expected solution: at both ends and in the mean over the time, over sqrt(c).
struct Calibration {
  double left, right, mean;
};

Calibration calibrate(const SpeedProblem& p, const Doubles& c, int k) {
  const SpeedState from = p.at_node(c, k), to = p.at_node(c, k + 1);
  const auto i = static_cast<size_t>(k);
  const double v0 = std::sqrt(std::max(from.b, 0.0)),
               root = from.b + 2.0 / 3.0 * p.h[i] * (2 * from.a + to.a);
  const double mean = (v0 + std::sqrt(std::max(root, 0.0))) / 2, scale = 1 / std::sqrt(c[i]);
  const auto sane = [](double ratio) { return std::clamp(ratio, 0.5, 1.6); };
  return {sane(v0 * scale), sane(std::sqrt(std::max(to.b, 0.0)) * scale), sane(mean * scale)};
}

void set_jerk_rows(const std::deque<GridInterval>& grid, size_t first, const JointRates& rates,
                   const std::deque<Headroom>& headroom, const Doubles& expected, SpeedProblem& p) {
  const size_t n = static_cast<size_t>(p.intervals);
  for (Doubles* v : {&p.jerk0, &p.jerk1, &p.jerk2}) v->assign(2 * n * static_cast<size_t>(p.joints), 0);
  for (size_t k = 0; k < n; ++k) {
    const GridInterval& g = grid[first + k];
    const Calibration speed = calibrate(p, expected, static_cast<int>(k));
    const double slope0 = -p.node_a0[k] / p.h[k], slope1 = (p.node_a0[k + 1] - p.node_a1[k]) / p.h[k],
                 slope2 = p.node_a1[k + 1] / p.h[k];
    for (size_t j = 0; j < static_cast<size_t>(p.joints); ++j) {
      const double scale = 1 / (rates.jerk[j] * headroom[first + k].jerk);
      for (const bool right : {false, true}) {
        const EndRow e = end_row(g, j, right);
        const size_t node = k + (right ? 1 : 0), row = (2 * j + (right ? 1 : 0)) * n + k;
        const double along = scale * e.d1 * speed.mean, across = scale * (right ? speed.right : speed.left);
        const double low = across * (3 * e.d2 * p.node_a0[node] + e.d3 * p.node_b0[node]);
        const double high = across * (3 * e.d2 * p.node_a1[node] + e.d3 * p.node_b1[node]);
        p.jerk0[row] = along * slope0 + (right ? 0 : low);
        p.jerk1[row] = along * slope1 + (right ? low : high);
        p.jerk2[row] = along * slope2 + (right ? high : 0);
      }
    }
  }
}

}  // namespace

SpeedState SpeedProblem::at_node(const Doubles& c, int node) const {
  const auto k = static_cast<size_t>(node);
  const double before = k > 0 ? c[k - 1] : 0, after = k < c.size() ? c[k] : 0;
  return {node_b0[k] * before + node_b1[k] * after, node_a0[k] * before + node_a1[k] * after};
}

void build_problem(const std::deque<GridInterval>& grid, size_t first, size_t n, const JointRates& rates,
                   const std::deque<Headroom>& headroom, const PlanEnd& start, const PlanEnd& end,
                   const Doubles& expected, SpeedProblem& p) {
  p.intervals = static_cast<int>(n);
  p.joints = rates.count;
  p.h.resize(n);
  p.c_max.resize(n);
  for (size_t k = 0; k < n; ++k) {
    const GridInterval& g = grid[first + k];
    p.h[k] = g.h;
    double b_max = g.samples.front().b_max;
    for (const PathSample& sample : g.samples) b_max = std::min(b_max, sample.b_max);
    if (k > 0) b_max = std::min(b_max, grid[first + k - 1].samples.back().b_max);
    if (k + 1 < n) b_max = std::min(b_max, grid[first + k + 1].samples.front().b_max);
    p.c_max[k] = b_max * headroom[first + k].velocity;
  }
  set_nodes(start, end, p);
  if (start.at_rest) p.c_max[0] = std::min(p.c_max[0], start.b_max / p.node_b1[0]);
  p.c_max[n - 1] = std::min(p.c_max[n - 1], end.b_max / p.node_b0[n]);
  if (p.first_fixed) p.c_max[0] = 2 * p.first_c;  // decided before, no longer a choice
  set_acceleration_rows(grid, first, rates, headroom, p);
  set_jerk_rows(grid, first, rates, headroom, expected, p);
}

}  // namespace trn::speed

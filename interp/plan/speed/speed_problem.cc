#include "interp/plan/speed/speed_problem.h"

#include <algorithm>
#include <cmath>

namespace trn::speed {

namespace {

constexpr double kStill = 1e-12;  // a derivative below this share of a limit moves nothing

// Joints that move anywhere on the grid's intervals [first, first + n).
std::vector<size_t> moving_joints(const std::deque<GridInterval>& grid, size_t first, size_t n,
                                  const JointRates& rates) {
  std::vector<size_t> out;
  for (size_t j = 0; j < static_cast<size_t>(rates.count); ++j) {
    bool moves = false;
    for (size_t k = first; k < first + n && !moves; ++k)
      for (const PathSample& p : grid[k].samples)
        moves |= std::abs(p.d1[j]) > kStill * rates.velocity[j] ||
                 std::abs(p.d2[j]) > kStill * rates.acceleration[j];
    if (moves) out.push_back(j);
  }
  return out;
}

// The derivatives used at one end of an interval: those of the end's own sample, but the widest d3 of all
// samples of the interval, so that a peak inside is seen.
double end_d3(const GridInterval& g, size_t joint, bool right) {
  const double own = (right ? g.samples.back() : g.samples.front()).d3[joint];
  const double other = (right ? g.samples.front() : g.samples.back()).d3[joint];
  const bool upper = own > other || (own == other && right);
  double d3 = own;
  for (const PathSample& p : g.samples) d3 = upper ? std::max(d3, p.d3[joint]) : std::min(d3, p.d3[joint]);
  return d3;
}

void set_nodes(const PlanEnd& start, const PlanEnd& end, SpeedProblem& p) {
  const size_t n = p.intervals;
  for (Doubles* v : {&p.node_b0, &p.node_b1, &p.node_a0, &p.node_a1})
    v->assign((lane_groups(n + 1) + 1) * kLanes, 0);
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
                           const std::vector<size_t>& joints, const std::deque<Headroom>& headroom,
                           SpeedProblem& p) {
  const size_t n = p.intervals;
  p.acceleration.assign(lane_groups(n + 1) * joints.size(), AccelerationRow{});
  for (size_t k = p.first_fixed ? 1 : 0; k <= n; ++k) {
    const GridInterval& g = grid[first + std::min(k, n - 1)];
    const PathSample& at = k < n ? g.samples.front() : g.samples.back();
    double share = headroom[first + std::min(k, n - 1)].acceleration;
    if (k > 0) share = std::min(share, headroom[first + k - 1].acceleration);
    AccelerationRow* rows = &p.acceleration[k / kLanes * joints.size()];
    for (size_t i = 0; i < joints.size(); ++i) {
      const double scale = 1 / (rates.acceleration[joints[i]] * share);
      rows[i].d1[k % kLanes] = static_cast<float>(scale * at.d1[joints[i]]);
      rows[i].d2[k % kLanes] = static_cast<float>(scale * at.d2[joints[i]]);
    }
  }
}

void set_jerk_rows(const std::deque<GridInterval>& grid, size_t first, const JointRates& rates,
                   const std::vector<size_t>& joints, const std::deque<Headroom>& headroom, SpeedProblem& p) {
  const size_t n = p.intervals;
  p.jerk.assign(lane_groups(n) * 2 * joints.size(), JerkRow{});
  for (size_t k = 0; k < n; ++k) {
    const GridInterval& g = grid[first + k];
    JerkRow* row = &p.jerk[k / kLanes * 2 * joints.size()];
    for (const bool right : {false, true}) {
      const PathSample& at = right ? g.samples.back() : g.samples.front();
      for (const size_t joint : joints) {
        const double scale = 1 / (rates.jerk[joint] * headroom[first + k].jerk);
        row->d1[k % kLanes] = static_cast<float>(scale * at.d1[joint]);
        row->d2[k % kLanes] = static_cast<float>(scale * at.d2[joint]);
        row->d3[k % kLanes] = static_cast<float>(scale * end_d3(g, joint, right));
        ++row;
      }
    }
  }
}

}  // namespace

SpeedState SpeedProblem::at_node(const Doubles& c, size_t k) const {
  const double before = k > 0 ? c[k - 1] : 0, after = k < c.size() ? c[k] : 0;
  return {node_b0[k] * before + node_b1[k] * after, node_a0[k] * before + node_a1[k] * after};
}

void build_problem(const std::deque<GridInterval>& grid, size_t first, size_t n, const JointRates& rates,
                   const std::deque<Headroom>& headroom, const PlanEnd& start, const PlanEnd& end,
                   SpeedProblem& p) {
  const std::vector<size_t> joints = moving_joints(grid, first, n, rates);
  p.intervals = n;
  p.joints = joints.size();
  p.h.assign(lane_groups(n + 1) * kLanes, 1);
  p.c_max.resize(lane_groups(n + 1) * kLanes);
  p.dip.assign(lane_groups(n + 1) * kLanes, 1);
  for (size_t k = 0; k < n; ++k) {
    const GridInterval& g = grid[first + k];
    p.h[k] = g.h;
    double b_max = g.samples.front().b_max;
    for (const PathSample& sample : g.samples) b_max = std::min(b_max, sample.b_max);
    if (k > 0) b_max = std::min(b_max, grid[first + k - 1].samples.back().b_max);
    if (k + 1 < n) b_max = std::min(b_max, grid[first + k + 1].samples.front().b_max);
    p.c_max[k] = b_max * headroom[first + k].velocity;
    p.dip[k] = headroom[first + k].dip;
  }
  set_nodes(start, end, p);
  if (start.at_rest) p.c_max[0] = std::min(p.c_max[0], start.b_max / p.node_b1[0]);
  p.c_max[n - 1] = std::min(p.c_max[n - 1], end.b_max / p.node_b0[n]);
  std::fill(p.c_max.begin() + static_cast<std::ptrdiff_t>(n), p.c_max.end(), 2 * p.c_max[n - 1]);
  if (p.first_fixed) p.c_max[0] = 2 * p.first_c;  // decided before, no longer a choice
  set_acceleration_rows(grid, first, rates, joints, headroom, p);
  set_jerk_rows(grid, first, rates, joints, headroom, p);
}

}  // namespace trn::speed

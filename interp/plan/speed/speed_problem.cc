#include "interp/plan/speed/speed_problem.h"

#include <algorithm>
#include <cmath>

#include "interp/plan/speed/path_sampler.h"

namespace trn::speed {

namespace {

constexpr double kStill = 1e-12;  // a derivative below this share of a limit moves nothing

/// What the rows of an interval are made of: the least b_max and the range of d3 of its samples.
struct SampleRange {
  double b_max = 1e300;
  PerJoint d3_min{}, d3_max{};
};

SampleRange range_of(const std::vector<PathSample>& samples) {
  SampleRange out;
  out.d3_min = out.d3_max = samples.front().d3;
  for (const PathSample& p : samples) {
    out.b_max = std::min(out.b_max, p.b_max);
    for (size_t j = 0; j < kMaxJoints; ++j) {
      out.d3_min[j] = std::min(out.d3_min[j], p.d3[j]);
      out.d3_max[j] = std::max(out.d3_max[j], p.d3[j]);
    }
  }
  return out;
}

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

// b and a at the nodes as linear forms of the coefficients beside them. Inside, continuity of a gives
// b = (h_k c_k-1 + h_k-1 c_k) / (h_k-1 + h_k) and a = (c_k - c_k-1) / (h_k-1 + h_k). At an end at rest, a is
// tied to b by the constant jerk from or to the standstill; at a moving start c_0 is given, and the forms
// reproduce the state.
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

// The row P5 of node k, for all joints. A node belongs to both its intervals: the lesser headroom counts.
void set_acceleration_row(const std::deque<GridInterval>& grid, size_t first, size_t k,
                          const JointRates& rates, const std::deque<Headroom>& headroom, SpeedProblem& p) {
  const size_t n = p.intervals, joints = p.joints;
  const GridInterval& g = grid[first + std::min(k, n - 1)];
  const PathSample& at = k < n ? g.samples.front() : g.samples.back();
  double share = headroom[first + std::min(k, n - 1)].acceleration;
  if (k > 0) share = std::min(share, headroom[first + k - 1].acceleration);
  AccelerationRow* rows = &p.acceleration[k / kLanes * joints];
  const double by_share = 1 / share;
  for (size_t i = 0; i < joints; ++i) {
    const size_t j = p.moving[i];
    const double scale = rates.acceleration_inverse[j] * by_share;
    rows[i].d1[k % kLanes] = static_cast<float>(scale * at.d1[j]);
    rows[i].d2[k % kLanes] = static_cast<float>(scale * at.d2[j]);
  }
}

// The rows P9 at both ends of an interval: q' and q'' of the end's own sample, but q''' the least of all
// samples at one end and the greatest at the other, so that a peak between the ends counts.
void set_jerk_rows(const GridInterval& g, const SampleRange& range, const JointRates& rates, double share,
                   size_t k, SpeedProblem& p) {
  const std::vector<size_t>& joints = p.moving;
  const size_t lane = k % kLanes;
  JerkRow* const row = &p.jerk[k / kLanes * 2 * joints.size()];
  const PathSample &left = g.samples.front(), &right = g.samples.back();
  const double by_share = 1 / share;
  for (size_t i = 0; i < joints.size(); ++i) {
    const size_t j = joints[i];
    const double scale = rates.jerk_inverse[j] * by_share;
    const bool rising = right.d3[j] >= left.d3[j];
    const auto put = [&](JerkRow& to, const PathSample& at, double d3) {
      to.d1[lane] = static_cast<float>(scale * at.d1[j]);
      to.d2[lane] = static_cast<float>(scale * at.d2[j]);
      to.d3[lane] = static_cast<float>(scale * d3);
    };
    put(row[i], left, rising ? range.d3_min[j] : range.d3_max[j]);
    put(row[i + joints.size()], right, rising ? range.d3_max[j] : range.d3_min[j]);
  }
}

void lay_out(const std::deque<GridInterval>& grid, size_t first, size_t n, const JointRates& rates,
             SpeedProblem& p) {
  p.intervals = n;
  p.moving = moving_joints(grid, first, n, rates);
  p.joints = p.moving.size();
  p.h.assign(lane_groups(n + 1) * kLanes, 1);
  for (size_t k = 0; k < n; ++k) p.h[k] = grid[first + k].h;
  p.c_max.resize(lane_groups(n + 1) * kLanes);
  p.dip.assign(lane_groups(n + 1) * kLanes, 1);
  p.jerk.assign(lane_groups(n) * 2 * p.joints, JerkRow{});
  p.acceleration.assign(lane_groups(n + 1) * p.joints, AccelerationRow{});
}

}  // namespace

double coefficient_bound(const std::deque<GridInterval>& grid, size_t first, size_t n, size_t k) {
  double b_max = range_of(grid[first + k].samples).b_max;
  if (k > 0) b_max = std::min(b_max, grid[first + k - 1].samples.back().b_max);
  if (k + 1 < n) b_max = std::min(b_max, grid[first + k + 1].samples.front().b_max);
  return b_max;
}

SpeedState SpeedProblem::at_node(const Doubles& c, size_t k) const {
  const double before = k > 0 ? c[k - 1] : 0, after = k < c.size() ? c[k] : 0;
  return {node_b0[k] * before + node_b1[k] * after, node_a0[k] * before + node_a1[k] * after};
}

void build_problem(const std::deque<GridInterval>& grid, size_t first, size_t n, const JointRates& rates,
                   const std::deque<Headroom>& headroom, const PlanEnd& start, const PlanEnd& end,
                   const std::vector<bool>& changed, SpeedProblem& p) {
  const bool all = changed.empty();
  const auto is_new = [&](size_t k) { return all || changed[first + k] || k == 0 || k + 1 == n; };
  if (all) lay_out(grid, first, n, rates, p);
  for (size_t k = 0; k < n; ++k) {
    if (!is_new(k)) continue;
    const GridInterval& g = grid[first + k];
    const Headroom& room = headroom[first + k];
    const SampleRange range = range_of(g.samples);
    p.c_max[k] = coefficient_bound(grid, first, n, k) * room.velocity;
    p.dip[k] = room.dip;
    set_jerk_rows(g, range, rates, room.jerk, k, p);
  }
  set_nodes(start, end, p);
  if (start.at_rest) p.c_max[0] = std::min(p.c_max[0], start.b_max / p.node_b1[0]);
  p.c_max[n - 1] = std::min(p.c_max[n - 1], end.b_max / p.node_b0[n]);
  std::fill(p.c_max.begin() + static_cast<std::ptrdiff_t>(n), p.c_max.end(), 2 * p.c_max[n - 1]);
  if (p.first_fixed) p.c_max[0] = 2 * p.first_c;  // decided before, no longer a choice
  for (size_t k = p.first_fixed ? 1 : 0; k <= n; ++k)
    if ((k < n && is_new(k)) || (k > 0 && is_new(k - 1)))
      set_acceleration_row(grid, first, k, rates, headroom, p);
}

}  // namespace trn::speed

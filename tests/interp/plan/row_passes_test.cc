#include "interp/plan/speed/row_passes.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "interp/plan/lanes.h"
#include "interp/plan/speed/speed_problem.h"
#include "tests/interp/plan/speed_support.h"

namespace trn::speed_test {
namespace {

using speed::PassState;
using speed::SpeedProblem;

constexpr size_t kIntervals = 6, kJoints = 2;

/// A problem with random rows, set up as InteriorPoint does it.
struct RandomCase {
  SpeedProblem problem;
  PassState state;

  explicit RandomCase(unsigned seed) {
    std::mt19937_64 rng(seed);
    std::uniform_real_distribution<double> u(0.5, 1.5), sign(-1, 1);
    const size_t n = kIntervals, padded = lane_groups(n + 1) * kLanes, nodes = padded + kLanes;
    problem.intervals = n;
    problem.joints = kJoints;
    problem.h.assign(padded, 1);
    problem.c_max.assign(padded, 6);
    problem.dip.assign(padded, 1);
    for (Doubles* v : {&problem.node_b0, &problem.node_b1, &problem.node_a0, &problem.node_a1})
      v->assign(nodes, 0);
    for (size_t k = 0; k < n; ++k) {
      problem.h[k] = u(rng);
      problem.c_max[k] = 3 * u(rng);
      problem.dip[k] = u(rng);
    }
    for (size_t k = 0; k <= n; ++k) {
      problem.node_b0[k] = k > 0 ? 0.5 * u(rng) : 0;
      problem.node_b1[k] = k < n ? 0.5 * u(rng) : 0;
      problem.node_a0[k] = k > 0 ? sign(rng) : 0;
      problem.node_a1[k] = k < n ? sign(rng) : 0;
    }
    problem.acceleration.assign(lane_groups(n + 1) * kJoints, speed::AccelerationRow{});
    problem.jerk.assign(lane_groups(n) * 2 * kJoints, speed::JerkRow{});
    const auto fill = [&](Lanes& lanes) {
      for (size_t i = 0; i < kLanes; ++i) lanes[i] = static_cast<float>(0.4 * sign(rng));
    };
    for (auto& row : problem.acceleration) fill(row.d1), fill(row.d2);
    for (auto& row : problem.jerk) fill(row.d1), fill(row.d2), fill(row.d3);
    state.problem = &problem;
    state.x.assign(nodes + 2, 3);
    state.dx.assign(nodes + 2, 0);
    for (size_t k = 1; k <= n; ++k) {
      state.x[k] = u(rng);
      state.dx[k] = 0.1 * sign(rng);
    }
    for (Doubles* v : {&state.mean, &state.left, &state.right, &state.jerk_duals}) v->assign(nodes, 1);
    state.root.assign(nodes, 1 / std::sqrt(3.0));
    state.dip_scale.assign(nodes, 0.7);
    speed::update_speeds(state);
  }
};

/// An inequality g(c) <= 0 with its gradient, slack and multiplier, in double.
struct Row {
  double g = 0;
  Eigen::VectorXd d;
  double w = 0, z = 0;
};

/// All rows, from the equations P5, P9, P4 and P13, one by one.
std::vector<Row> dense_rows(const RandomCase& r, double mu, double least) {
  const SpeedProblem& p = r.problem;
  const auto& s = r.state;
  const size_t intervals = lane_groups(kIntervals) * kLanes, nodes = lane_groups(kIntervals + 1) * kLanes;
  const auto size = static_cast<Eigen::Index>(s.x.size());
  std::vector<Row> rows;
  const auto add = [&](double value, const Eigen::VectorXd& d, double room, const Eigen::VectorXd& d_room) {
    for (const double side : {1.0, -1.0}) {
      Row row{side * value - room, side * d - d_room, least * room, mu / (least * room)};
      row.w = std::max(row.w, -row.g);
      rows.push_back(row);
    }
  };
  const auto add_single = [&](double g, const Eigen::VectorXd& d) {
    rows.push_back({g, d, std::max(least, -g), mu / least});
  };
  const auto unit = [&](size_t at) -> Eigen::VectorXd {
    return Eigen::VectorXd::Unit(size, static_cast<Eigen::Index>(at));
  };
  const Eigen::Map<const Eigen::VectorXd> x(s.x.data(), size);
  const auto b_form = [&](size_t k) -> Eigen::VectorXd {
    return p.node_b0[k] * unit(k) + p.node_b1[k] * unit(k + 1);
  };
  const auto a_form = [&](size_t k) -> Eigen::VectorXd {
    return p.node_a0[k] * unit(k) + p.node_a1[k] * unit(k + 1);
  };
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(size);
  for (size_t k = 0; k < nodes; ++k)
    for (size_t j = 0; j < kJoints; ++j) {
      const auto& d = p.acceleration[k / kLanes * kJoints + j];
      const Eigen::VectorXd f = d.d1[k % kLanes] * a_form(k) + d.d2[k % kLanes] * b_form(k);
      add(f.dot(x), f, 1, none);
    }
  for (size_t k = 0; k < intervals; ++k) {
    const double c = s.x[k + 1], room = 1 / std::sqrt(c);
    for (size_t end = 0; end < 2; ++end)
      for (size_t j = 0; j < kJoints; ++j) {
        const auto& d = p.jerk[(2 * (k / kLanes) + end) * kJoints + j];
        const double v = end == 0 ? s.left[k] : s.right[k];
        const Eigen::VectorXd f = d.d1[k % kLanes] * s.mean[k] / p.h[k] * (a_form(k + 1) - a_form(k)) +
                                  3 * d.d2[k % kLanes] * v * a_form(k + end) +
                                  d.d3[k % kLanes] * v * b_form(k + end);
        add(f.dot(x), f, room, -0.5 * room / c * unit(k + 1));
      }
    add_single(c / p.c_max[k] - 1, unit(k + 1) / p.c_max[k]);
    const Eigen::VectorXd left = b_form(k) - p.dip[k] * (unit(k + 1) + b_form(k + 1)),
                          right = b_form(k + 1) - p.dip[k] * (unit(k + 1) + b_form(k));
    for (const Eigen::VectorXd& f : {left, right}) add_single(s.dip_scale[k] * f.dot(x), s.dip_scale[k] * f);
  }
  return rows;
}

// Speeds over sqrt(c) as constant jerk has them: h over the mean speed is the time in which it covers h.
TEST(RowPasses, SpeedsAreThoseOfConstantJerk) {
  RandomCase r(1);
  SpeedProblem& p = r.problem;
  for (size_t k = 1; k < kIntervals; ++k) {  // a C1 spline
    const double sum = p.h[k - 1] + p.h[k];
    p.node_b0[k] = p.h[k] / sum;
    p.node_b1[k] = p.h[k - 1] / sum;
  }
  for (size_t k = 1; k <= kIntervals; ++k) r.state.x[k] = 2 + 0.1 * static_cast<double>(k % 3);
  speed::update_speeds(r.state);
  for (size_t k = 1; k + 1 < kIntervals; ++k) {
    const double c = r.state.x[k + 1], b0 = p.node_b0[k] * r.state.x[k] + p.node_b1[k] * c,
                 b1 = p.node_b0[k + 1] * c + p.node_b1[k + 1] * r.state.x[k + 2];
    EXPECT_NEAR(r.state.root[k], 1 / std::sqrt(c), 1e-14);
    EXPECT_NEAR(r.state.left[k] * std::sqrt(c), std::sqrt(b0), 1e-13);
    EXPECT_NEAR(r.state.right[k] * std::sqrt(c), std::sqrt(b1), 1e-13);
    const double a0 = (c - b0) / p.h[k], a1 = (b1 - c) / p.h[k],
                 T = p.h[k] / (r.state.mean[k] * std::sqrt(c));
    EXPECT_NEAR(std::sqrt(b0) * T + (2 * a0 + a1) * T * T / 6, p.h[k], 1e-12);
  }
}

// Matrix and right side of P11, and the violation of P10, against dense rows.
TEST(RowPasses, TheSystemIsTheSumOverAllRows) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    RandomCase r(seed);
    const double mu = 0.03, least = 0.5;
    const auto rows = dense_rows(r, mu, least);
    const auto size = static_cast<Eigen::Index>(r.state.x.size());
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd rhs = Eigen::VectorXd::Zero(size);
    for (const Row& row : rows) {
      matrix += row.z / row.w * row.d * row.d.transpose();
      rhs -= (mu / row.w + row.z / row.w * (row.g + row.w)) * row.d;
    }
    speed::start_rows(r.state, mu, least);
    const double violation = speed::assemble_rows(r.state, {mu, 0, 0});
    const double scale = 2e-6 * matrix.cwiseAbs().maxCoeff();
    for (Eigen::Index i = 1; i <= static_cast<Eigen::Index>(kIntervals); ++i) {
      const auto k = static_cast<size_t>(i);
      EXPECT_NEAR(r.state.diag[k], matrix(i, i), scale);
      EXPECT_NEAR(r.state.off1[k], matrix(i, i + 1), scale);
      EXPECT_NEAR(r.state.off2[k], matrix(i, i + 2), scale);
      EXPECT_NEAR(r.state.rhs[k], rhs(i), 2e-6 * rhs.cwiseAbs().maxCoeff());
    }
    double worst = 0;
    size_t at = 0;
    for (const Row& row : rows) {  // of jerk rows as a share of their room, 1 / sqrt(c)
      const size_t nodes = lane_groups(kIntervals + 1) * kLanes * kJoints * 2, in = at - nodes;
      const size_t of_interval = 4 * kJoints + 3;
      const bool jerk = at >= nodes && in % of_interval < 4 * kJoints;
      const double c = jerk ? r.state.x[in / of_interval + 1] : 1;
      worst = std::max(worst, (row.g + row.w) * std::sqrt(c));
      ++at;
    }
    EXPECT_NEAR(violation, worst, 1e-5);
  }
}

// P12 for a given dx, through the sums that the search uses; then the step taken.
TEST(RowPasses, StepsOfSlacksAndMultipliersSolveTheLinearisedRows) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    RandomCase r(seed);
    const double mu = 0.03, least = 0.5;
    auto rows = dense_rows(r, mu, least);
    speed::start_rows(r.state, mu, least);
    speed::assemble_rows(r.state, {mu, 0, 0});
    const speed::StepSums sums = speed::find_row_steps(r.state, 0.5 * mu);
    const Eigen::Map<const Eigen::VectorXd> dx(r.state.dx.data(),
                                               static_cast<Eigen::Index>(r.state.dx.size()));
    speed::StepSums want;
    for (const Row& row : rows) {
      const double dw = -(row.g + row.w) - row.d.dot(dx), dz = (0.5 * mu - row.z * dw) / row.w - row.z;
      want.worst = std::max(want.worst, -dw / row.w);
      want.worst_dual = std::max(want.worst_dual, -dz / row.z);
      want.slack_dual += row.w * row.z;
      want.slack_step_dual += dw * row.z;
      want.slack_dual_step += row.w * dz;
      want.steps += dw * dz;
    }
    EXPECT_NEAR(sums.worst, want.worst, 1e-5);
    EXPECT_NEAR(sums.worst_dual, want.worst_dual, 1e-5);
    EXPECT_NEAR(sums.slack_dual, want.slack_dual, 1e-4 * want.slack_dual);
    EXPECT_NEAR(sums.slack_step_dual, want.slack_step_dual, 1e-4 * want.slack_dual);
    EXPECT_NEAR(sums.slack_dual_step, want.slack_dual_step, 1e-4 * want.slack_dual);
    EXPECT_NEAR(sums.steps, want.steps, 1e-4 * want.slack_dual);
  }
}

// Rows taken over: no slack below the least, no product farther than a factor of ten from mu.
TEST(RowPasses, CentringKeepsRowsNearTheCentralPath) {
  RandomCase r(3);
  speed::start_rows(r.state, 1.0, 1e-6);
  speed::assemble_rows(r.state, {1.0, 0, 0});
  speed::centre_rows(r.state, 1e-3, 0.01);
  for (const auto& row : r.state.single)
    for (size_t i = 0; i < kLanes; ++i) {
      EXPECT_GE(row.slack[i], 0.0099F);
      EXPECT_LE(row.slack[i] * row.dual[i], 1.01e-2F);
      EXPECT_GE(row.slack[i] * row.dual[i], 0.99e-4F);
    }
}

}  // namespace
}  // namespace trn::speed_test

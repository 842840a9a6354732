#include "interp/plan/geometry/tube_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>

#include "core/axes.h"
#include "interp/plan/geometry/quintic_spline.h"
#include "interp/plan/geometry/run_vertex.h"
#include "tests/interp/plan/geometry_check.h"

namespace trn::geometry_check {
namespace {

/// A tube around a zigzag, on a spline with uneven spans.
struct Tube {
  QuinticSpline spline;
  std::vector<TubeSample> samples;
  double radius = 0.02;

  Tube() {
    std::vector<double> breaks{0};
    for (int i = 0; i < 20; ++i) breaks.push_back(breaks.back() + 0.8 + 0.3 * std::sin(i));
    spline.knots.assign(5, 0.0);
    spline.knots.insert(spline.knots.end(), breaks.begin(), breaks.end());
    spline.knots.insert(spline.knots.end(), 5, breaks.back());
    spline.coefficients.assign(spline.knots.size() - 6, Words::Zero());
    const double step = 0.125;
    for (double u = 0; u < breaks.back(); u += step) {
      TubeSample s{};
      s.row = {};
      s.u = u;
      s.weight = step;
      s.target = s.middle = words(u, 0.3 * std::sin(u) + 0.01 * (std::abs(std::remainder(u, 1.0)) - 0.25));
      s.radius_mm = radius;
      s.radius_rad = 1e-3;
      samples.push_back(s);
    }
    locate_samples(spline, samples);
  }
  TubeFit::Free all() const { return {0, spline.coefficients.size()}; }
  Words at(const TubeSample& s) const {
    Words y = Words::Zero();
    for (size_t i = 0; i < 6; ++i) y += s.row[i] * spline.coefficients[s.span + i];
    return y;
  }
  double worst_use() const {
    double worst = 0;
    for (const TubeSample& s : samples) worst = std::max(worst, (at(s) - s.middle).norm() / s.radius_mm);
    return worst;
  }
};

/// The quadratic form of the integral of |y'''|^2, by Simpson's rule on third differences of the basis.
Eigen::MatrixXd roughness(const QuinticSpline& spline) {
  const auto n = static_cast<Eigen::Index>(spline.coefficients.size());
  Eigen::MatrixXd form = Eigen::MatrixXd::Zero(n, n);
  for (size_t k = 0; k < static_cast<size_t>(spline.span_count()); ++k) {
    const double u0 = spline.knots[k + 5], h = spline.knots[k + 6] - u0, e = h / 8;
    // Each basis function is a polynomial of degree 5 on the span: seven-point differences of its third
    // derivative are exact for it.
    const auto third = [&](double u) {
      Eigen::VectorXd out = Eigen::VectorXd::Zero(n);
      constexpr double kWeight[7] = {1, -8, 13, 0, -13, 8, -1};
      for (int i = 0; i < 7; ++i) {
        const auto row = basis_row(spline, k, u + (i - 3) * e);
        for (size_t j = 0; j < 6; ++j)
          out[static_cast<Eigen::Index>(k + j)] += kWeight[i] * row[j] / (8 * e * e * e);
      }
      return out;
    };
    constexpr double kBoole[5] = {7, 32, 12, 32, 7};  // exact to degree 5; the square has degree 4
    for (int g = 0; g < 5; ++g) {
      const Eigen::VectorXd d = third(u0 + h * g / 4);
      form += h * kBoole[g] / 90 * d * d.transpose();
    }
  }
  return form;
}

double energy(const Tube& tube) {
  const Eigen::MatrixXd form = roughness(tube.spline);
  double sum = 0;
  for (int word = 0; word < 2; ++word) {
    Eigen::VectorXd c(form.rows());
    for (Eigen::Index i = 0; i < c.size(); ++i) c[i] = tube.spline.coefficients[static_cast<size_t>(i)][word];
    sum += c.dot(form * c);
  }
  return sum;
}

// follow() is linear least squares: its normal equations, dense. The smoothing length is 0.4 of each span.
TEST(TubeFit, FollowingSolvesTheDenseNormalEquations) {
  Tube tube;
  Eigen::MatrixXd form = roughness(tube.spline);
  Eigen::MatrixXd rhs = Eigen::MatrixXd::Zero(form.rows(), 6);
  for (const TubeSample& s : tube.samples) {
    Eigen::VectorXd row = Eigen::VectorXd::Zero(form.rows());
    for (size_t i = 0; i < 6; ++i) row[static_cast<Eigen::Index>(s.span + i)] = s.row[i];
    const double h = tube.spline.knots[s.span + 6] - tube.spline.knots[s.span + 5];
    const double weight = s.weight / std::pow(0.4 * h, 6);
    form += weight * row * row.transpose();
    rhs += weight * row * s.target.transpose();
  }
  const Eigen::MatrixXd want = form.ldlt().solve(rhs);
  TubeFit(tube.spline, tube.samples, tube.all()).follow();
  for (size_t i = 0; i < tube.spline.coefficients.size(); ++i)
    for (int word = 0; word < 2; ++word)
      EXPECT_NEAR(tube.spline.coefficients[i][word], want(static_cast<Eigen::Index>(i), word), 1e-6) << i;
}

// Coefficients outside of the free ones keep their values, and the others know of them.
TEST(TubeFit, GivenCoefficientsStay) {
  Tube tube;
  TubeFit(tube.spline, tube.samples, tube.all()).follow();
  const QuinticSpline whole = tube.spline;
  for (size_t i = 5; i + 4 < tube.spline.coefficients.size(); ++i)
    tube.spline.coefficients[i] = Words::Zero();
  TubeFit(tube.spline, tube.samples, {5, tube.spline.coefficients.size() - 4}).follow();
  for (size_t i = 0; i < whole.coefficients.size(); ++i)
    EXPECT_LT((tube.spline.coefficients[i] - whole.coefficients[i]).norm(), 1e-7) << i;
}

// Inside the tube, and much smoother than what follows the target; near the minimum for the tube: a random
// change that stays in a tube of the same use is hardly smoother.
TEST(TubeFit, SmoothingStaysInTheTubeAndUsesIt) {
  Tube tube;
  TubeFit fit(tube.spline, tube.samples, tube.all());
  fit.follow();
  const double followed = energy(tube);
  fit.smooth();
  EXPECT_LT(energy(tube), 0.9 * followed);
  EXPECT_LT(tube.worst_use(), 1.0);
  EXPECT_GT(tube.worst_use(), 0.4);
}

// With a barrier of one weight m everywhere the gradient of P3 vanishes: m a tenth of the mean of |y'''|^2.
TEST(TubeFit, TheBarrierBalancesTheRoughness) {
  Tube tube;
  TubeFit fit(tube.spline, tube.samples, tube.all());
  fit.follow();
  fit.smooth();
  const Eigen::MatrixXd form = roughness(tube.spline);
  const size_t n = tube.spline.coefficients.size();
  Eigen::VectorXd y(form.rows()), push = Eigen::VectorXd::Zero(form.rows());
  for (size_t i = 0; i < n; ++i) y[static_cast<Eigen::Index>(i)] = tube.spline.coefficients[i][kY];
  for (const TubeSample& s : tube.samples) {
    const Words off = tube.at(s) - s.middle;
    const double room = 1 - off.squaredNorm() / (s.radius_mm * s.radius_mm);
    for (size_t i = 0; i < 6; ++i)
      push[static_cast<Eigen::Index>(s.span + i)] +=
          s.weight * s.row[i] * off[kY] / (s.radius_mm * s.radius_mm * room);
  }
  // Stationary: form y + m push = 0 with m a tenth of the local mean of |y'''|^2, which varies: the best
  // single m, by least squares, lies near a tenth of the mean over the whole length.
  const double m = -(form * y).dot(push) / push.squaredNorm(), mean = energy(tube) / tube.samples.back().u;
  EXPECT_GT(m, 0.05 * mean);
  EXPECT_LT(m, 0.2 * mean);
  EXPECT_LT((form * y + m * push).norm(), 0.6 * (form * y).norm());
}

/// A straight tube from 0 to 12 whose radius changes abruptly, in spans of 1; mirrored: seen from its end.
std::vector<Words> fitted_in_changing_tube(bool mirrored) {
  QuinticSpline spline;
  spline.knots.assign(5, 0.0);
  for (int k = 0; k <= 12; ++k) spline.knots.push_back(k);
  spline.knots.insert(spline.knots.end(), 5, 12.0);
  spline.coefficients.assign(spline.knots.size() - 6, Words::Zero());
  const int parts = 16 * 12;
  std::vector<TubeSample> samples;
  for (int i = 0; i < parts; ++i) {
    const double u = (i + 0.5) / 16, s = mirrored ? 12 - u : u;
    TubeSample sample{};
    sample.u = u;
    sample.weight = 1.0 / 16;
    sample.target = sample.middle = words(0, 0.03 * std::sin(1.5 * s) + 0.005 * std::sin(7 * s));
    sample.radius_mm = s < 1 ? 1e-3 : 0.05;
    sample.radius_rad = 1e-3;
    samples.push_back(sample);
  }
  locate_samples(spline, samples);
  TubeFit fit(spline, samples, {0, spline.coefficients.size()});
  fit.follow();
  fit.smooth();
  if (mirrored) std::reverse(spline.coefficients.begin(), spline.coefficients.end());
  return spline.coefficients;
}

// The minimum knows no direction: the mirrored tube has the mirrored curve.
TEST(TubeFit, NeitherEndIsPreferred) {
  const std::vector<Words> forward = fitted_in_changing_tube(false), back = fitted_in_changing_tube(true);
  for (size_t i = 0; i < forward.size(); ++i) EXPECT_LT((forward[i] - back[i]).norm(), 1e-9) << i;
}

TEST(TubeFit, TighteningLowersTheUseWhereItIsAskedTo) {
  Tube tube;
  TubeFit fit(tube.spline, tube.samples, tube.all());
  fit.follow();
  fit.smooth();
  const double before = tube.worst_use();
  std::vector<TubeUse> usage(static_cast<size_t>(tube.spline.span_count()));
  for (const TubeSample& s : tube.samples)
    usage[s.span].raise({(tube.at(s) - s.middle).norm() / s.radius_mm, 0});
  fit.tighten(usage, 0.9 * before, 1);
  EXPECT_LT(tube.worst_use(), before);
}

}  // namespace
}  // namespace trn::geometry_check

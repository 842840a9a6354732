#include "interp/plan/geometry/tube_samples.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>
#include <vector>

// Sums over dense matrices judge the ones over bands.
namespace trn::tube {
namespace {

/// Samples in spans 0, 0, 0, 1, 3, 3: one span has none.
struct Case {
  static constexpr Eigen::Index kCoefficients = 9;
  std::vector<GroupSample> samples;
  std::vector<Point> coefficients{static_cast<size_t>(kCoefficients)};
  std::vector<double> weight{0.5, 2, 7, 3};

  Case() {
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> u(-1, 1);
    for (Point& point : coefficients) point.w = Triple{u(random), u(random), u(random), 0};
    for (const size_t span : {0, 0, 0, 1, 3, 3}) {
      GroupSample p{};
      p.span = span;
      for (int i = 0; i < 4; ++i) p.front[i] = u(random);
      p.back = Four{u(random), u(random), 0, 0};
      p.middle = Triple{u(random), u(random), u(random), 0};
      p.fit_target = Triple{u(random), u(random), u(random), 0};
      p.fit_weight = 1 + u(random);
      samples.push_back(p);
    }
  }
  static Eigen::VectorXd row(const GroupSample& p) {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(kCoefficients);
    for (Eigen::Index i = 0; i < 6; ++i)
      out[static_cast<Eigen::Index>(p.span) + i] = i < 4 ? p.front[i] : p.back[i - 4];
    return out;
  }
};

TEST(TubeSamples, DeviationsAreOfTheCurveFromTheMiddle) {
  const Case c;
  std::vector<Point> deviation(c.samples.size());
  find_deviations(c.samples, c.coefficients, deviation);
  for (size_t s = 0; s < c.samples.size(); ++s) {
    const Eigen::VectorXd row = Case::row(c.samples[s]);
    for (int word = 0; word < 3; ++word) {
      double y = -c.samples[s].middle[word];
      for (Eigen::Index i = 0; i < row.size(); ++i)
        y += row[i] * c.coefficients[static_cast<size_t>(i)].w[word];
      EXPECT_NEAR(deviation[s].w[word], y, 1e-14) << s;
    }
  }
}

TEST(TubeSamples, TheFormIsTheWeightedSumOfSquares) {
  const Case c;
  Eigen::MatrixXd form = Eigen::MatrixXd::Zero(Case::kCoefficients, Case::kCoefficients);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(Case::kCoefficients, 3);
  for (const GroupSample& p : c.samples) {
    const Eigen::VectorXd row = Case::row(p);
    const double weight = p.fit_weight * c.weight[p.span];
    form += weight * row * row.transpose();
    for (int word = 0; word < 3; ++word) right.col(word) += weight * p.fit_target[word] * row;
  }
  std::vector<BandRow> band(static_cast<size_t>(Case::kCoefficients), BandRow{});
  std::vector<Point> rhs(band.size(), Point{});
  for (BandRow& each : band) each[0] = 10;  // what is there stays
  add_fit_terms(c.samples, c.weight, band, rhs);
  for (Eigen::Index i = 0; i < Case::kCoefficients; ++i) {
    for (Eigen::Index k = 0; k < 6 && i + k < Case::kCoefficients; ++k)
      EXPECT_NEAR(band[static_cast<size_t>(i)][static_cast<size_t>(k)], form(i, i + k) + (k == 0 ? 10 : 0),
                  1e-13)
          << i << " " << k;
    for (int word = 0; word < 3; ++word)
      EXPECT_NEAR(rhs[static_cast<size_t>(i)].w[word], right(i, word), 1e-13) << i;
  }
}

}  // namespace
}  // namespace trn::tube

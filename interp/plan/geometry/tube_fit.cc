#include "interp/plan/geometry/tube_fit.h"

#include <algorithm>
#include <cmath>

namespace trn {

namespace {

constexpr double kFollow = 0.4;    // smoothing length of follow(), in spans
constexpr double kLongest = 6;     // spans; keeps the system well conditioned
constexpr double kShortest = 0.2;  // spans
constexpr double kSlope = 0.6;     // of the smoothing length along the path, at most
constexpr double kAim = 0.95;      // deviation over radius
constexpr double kEnough = 1.02;
constexpr double kGrow = 1.2, kShrink = 0.6;  // of the smoothing length in a round
constexpr double kExponent = 0.25;  // the deviation goes with the length itself or up to its power of 6
constexpr double kDrawIn = 0.82;
constexpr double kDrawInMost = 0.9, kDrawInLeast = 0.98;  // the judge's, in a round
constexpr int kRounds = 32, kWholeRounds = 12;            // then calmer and calmer
constexpr int kRoundsBack = 12;                           // to come inside, after these

bool moves(const std::vector<TubeSample>& samples, Eigen::Index first_word) {
  return std::any_of(samples.begin(), samples.end(),
                     [&](const TubeSample& s) { return !s.y.segment<3>(first_word).isZero(0); });
}

}  // namespace

TubeFit::Group::Group(QuinticSpline& spline, const std::vector<TubeSample>& samples, Free free, bool rotary)
    : spline_(spline),
      samples_(samples),
      first_word_(rotary ? 3 : 0),
      rotary_(rotary),
      from_(free.from),
      to_(free.to),
      penalty_(spline.coefficients.size(), Row{}),
      inverse_(spline.coefficients.size(), 0.0),
      rhs_(spline.coefficients.size(), Vec3::Zero()),
      y_(spline.coefficients.size(), Vec3::Zero()) {
  for (size_t i = 0; i < y_.size(); ++i) y_[i] = spline.coefficients[i].segment<3>(first_word_);
  for (size_t k = 0; k < static_cast<size_t>(spline.span_count()); ++k)
    span_.push_back(spline.knots[k + 6] - spline.knots[k + 5]);
  usage_.resize(span_.size());
  add_penalty();
}

void TubeFit::Group::follow() {
  length_ = span_;
  for (double& l : length_) l *= kFollow;
  solve();
  hand_back();
}

void TubeFit::Group::smooth() {
  double worst = measure();
  for (int round = 0; round < kRounds; ++round) {
    const double exponent = kExponent * std::min(1.0, static_cast<double>(kWholeRounds) / (round + 1));
    for (size_t k = 0; k < span_.size(); ++k)
      length_[k] *= std::clamp(std::pow(kAim / std::max(usage_[k], 1e-9), exponent), kShrink, kGrow);
    bound_lengths();
    solve();
    worst = measure();
  }
  for (int round = 0; round < kRoundsBack && worst > kEnough; ++round) {
    for (size_t k = 0; k < span_.size(); ++k)
      if (usage_[k] > 1) length_[k] *= kDrawIn;
    bound_lengths();
    solve();
    worst = measure();
  }
  hand_back();
}

void TubeFit::Group::draw_in(const std::vector<TubeUse>& usage, double usage_max, size_t reach) {
  const size_t n = span_.size();
  std::vector<double> factor(n, 1);
  for (size_t k = 0; k < n; ++k) {
    const double used = rotary_ ? usage[k].rotary : usage[k].linear;
    if (used <= usage_max) continue;
    const double shorter = std::clamp(std::pow(usage_max / used, kExponent), kDrawInMost, kDrawInLeast);
    for (size_t i = k - std::min(k, reach); i < std::min(n, k + reach + 1); ++i)
      factor[i] = std::min(factor[i], shorter);
  }
  for (size_t k = 0; k < n; ++k) length_[k] *= factor[k];
  bound_lengths();
  solve();
  hand_back();
}

void TubeFit::Group::bound_lengths() {
  const size_t n = span_.size();
  for (size_t k = 0; k < n; ++k)
    length_[k] = std::clamp(length_[k], kShortest * span_[k], kLongest * span_[k]);
  for (size_t k = 1; k < n; ++k)
    length_[k] = std::min(length_[k], length_[k - 1] + kSlope * (span_[k] + span_[k - 1]) / 2);
  for (size_t k = n - 1; k-- > 0;)
    length_[k] = std::min(length_[k], length_[k + 1] + kSlope * (span_[k] + span_[k + 1]) / 2);
}

void TubeFit::Group::add_penalty() {
  constexpr double kNode[3] = {-0.7745966692414834, 0, 0.7745966692414834};  // Gauss, exact for y'''^2
  constexpr double kWeight[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  for (size_t k = 0; k < span_.size(); ++k) {
    const double* t = spline_.knots.data() + k;
    for (int g = 0; g < 3; ++g) {
      const Row row = third_derivative_row(spline_, k, t[5] + span_[k] * (0.5 + 0.5 * kNode[g]));
      for (size_t i = 0; i < 6; ++i)
        for (size_t j = i; j < 6; ++j) penalty_[k + i][j - i] += span_[k] * kWeight[g] * row[i] * row[j];
    }
  }
}

void TubeFit::Group::assemble() {
  band_ = penalty_;
  std::fill(rhs_.begin(), rhs_.end(), Vec3::Zero());
  size_t span = ~size_t{0};
  double weight_of_span = 0;
  for (const TubeSample& s : samples_) {
    if (s.span != span) {
      span = s.span;
      weight_of_span = std::pow(length_[span], -6);
    }
    const double weight = weight_of_span * s.weight;
    const Vec3 y = s.target.segment<3>(first_word_);
    for (size_t i = 0; i < 6; ++i) {
      const double w = weight * s.row[i];
      Row& band = band_[s.span + i];
      for (size_t j = i; j < 6; ++j) band[j - i] += w * s.row[j];
      rhs_[s.span + i] += w * y;
    }
  }
  for (size_t i = from_ - std::min<size_t>(from_, 5); i < from_; ++i)
    for (size_t k = from_ - i; k < 6 && i + k < to_; ++k) rhs_[i + k] -= band_[i][k] * y_[i];
  for (size_t j = to_; j < std::min(y_.size(), to_ + 5); ++j)
    for (size_t k = j - to_ + 1; k < 6 && k <= j; ++k) rhs_[j - k] -= band_[j - k][k] * y_[j];
}

// L D L': afterwards band_[i][k], k > 0, is L(i + k, i).
void TubeFit::Group::factorise() {
  for (size_t i = from_; i < to_; ++i) {
    inverse_[i] = 1 / band_[i][0];
    Row scaled{};
    for (size_t k = 1; k < 6 && i + k < to_; ++k) scaled[k] = band_[i][k] * inverse_[i];
    for (size_t k = 1; k < 6 && i + k < to_; ++k)
      for (size_t j = k; j < 6; ++j) band_[i + k][j - k] -= scaled[k] * band_[i][j];
    for (size_t k = 1; k < 6; ++k) band_[i][k] = scaled[k];
  }
}

void TubeFit::Group::solve() {
  assemble();
  factorise();
  for (size_t i = from_; i < to_; ++i)
    for (size_t k = 1; k < 6 && i + k < to_; ++k) rhs_[i + k] -= band_[i][k] * rhs_[i];
  for (size_t i = to_; i-- > from_;) {
    Vec3 y = rhs_[i] * inverse_[i];
    for (size_t k = 1; k < 6 && i + k < to_; ++k) y -= band_[i][k] * y_[i + k];
    y_[i] = y;
  }
}

// Worst deviation over radius, by span and of all.
double TubeFit::Group::measure() {
  std::fill(usage_.begin(), usage_.end(), 0.0);
  double worst = 0;
  for (const TubeSample& s : samples_) {
    Vec3 e = -s.y.segment<3>(first_word_);
    for (size_t i = 0; i < 6; ++i) e += s.row[i] * y_[s.span + i];
    const double used = e.norm() / (rotary_ ? s.radius_rad : s.radius_mm);
    usage_[s.span] = std::max(usage_[s.span], used);
    worst = std::max(worst, used);
  }
  return worst;
}

void TubeFit::Group::hand_back() {
  for (size_t i = from_; i < to_; ++i) spline_.coefficients[i].segment<3>(first_word_) = y_[i];
}

void locate_samples(const QuinticSpline& spline, std::vector<TubeSample>& samples) {
  size_t k = 0;
  const size_t spans = static_cast<size_t>(spline.span_count());
  for (TubeSample& sample : samples) {
    while (k + 1 < spans && sample.u >= spline.knots[k + 6]) ++k;
    sample.span = k;
    sample.row = basis_row(spline, k, sample.u);
  }
}

TubeFit::TubeFit(QuinticSpline& spline, const std::vector<TubeSample>& samples, Free free) {
  for (const bool rotary : {false, true})
    if (moves(samples, rotary ? 3 : 0)) groups_.emplace_back(spline, samples, free, rotary);
}

void TubeFit::follow() {
  for (Group& group : groups_) group.follow();
}

void TubeFit::smooth() {
  for (Group& group : groups_) group.smooth();
}

void TubeFit::draw_in(const std::vector<TubeUse>& usage, double usage_max, size_t reach) {
  for (Group& group : groups_) group.draw_in(usage, usage_max, reach);
}

}  // namespace trn

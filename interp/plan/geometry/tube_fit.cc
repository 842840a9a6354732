#include "interp/plan/geometry/tube_fit.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace trn {

using tube::dot, tube::find_deviations, tube::add_fit_terms;
using tube::Four, tube::Triple;

namespace {
constexpr double kFollow = 0.4;    // smoothing length of follow(), in spans
constexpr double kBarrier = 0.05;  // half of m (P3) over the local mean of |y'''|^2
constexpr double kAveraging = 2;   // smoothing lengths over which that mean is taken
constexpr double kWall = 0.05;     // 1 - (deviation over radius)^2 from which on the barrier is a parabola
constexpr double kLongest = 6;     // smoothing length in spans; keeps the system well conditioned
constexpr double kShortest = 0.2;  // spans
constexpr double kSlope = 0.6;     // of the smoothing length along the path, at most
constexpr double kGrow = 3;        // of the smoothing length in a round
constexpr int kRounds = 16;
constexpr double kSettled = 0.01;        // radii that the curve may still move, and
constexpr double kSettledLength = 1.01;  // factor by which l may still change, when the rounds end
constexpr double kToWall = 0.95;         // share of the way to the wall that a step may go
constexpr double kLeastStep = 0.05;
constexpr double kStepGrowth = 1.5;  // of the step's share from a coefficient to the next
constexpr double kTightenMost = 0.9, kTightenLeast = 0.98;  // of the radius, in one tightening
constexpr int kTightenSteps = 2;

bool moves(const std::vector<TubeSample>& samples, Eigen::Index first_word) {
  return std::any_of(samples.begin(), samples.end(),
                     [&](const TubeSample& s) { return !s.middle.segment<3>(first_word).isZero(0); });
}

}  // namespace

// Coefficients of a derivative are differences of those of the derivative before it, over the distance of the
// knots in question (de Boor). y''' is a spline of degree 2, its square of degree 4 on a span, which the
// Gauss rule of three points integrates exactly.
TubeFit::Roughness::Roughness(const QuinticSpline& spline) : integral(spline.coefficients.size()) {
  const auto over = [&](size_t i, size_t order) {
    return static_cast<double>(6 - order) / (spline.knots[i + 6] - spline.knots[i + order]);
  };
  for (size_t i = 0; i + 3 < integral.size(); ++i) {
    const double a = over(i, 1), b = over(i + 1, 1), c = over(i + 2, 1), d = over(i, 2), e = over(i + 1, 2),
                 f = over(i, 3);
    third.push_back({-f * d * a, f * (e * b + d * (a + b)), -f * (e * (b + c) + d * b), f * e * c});
  }
  constexpr double kNode[3] = {-0.7745966692414834, 0, 0.7745966692414834}, kWeight[3] = {5, 8, 5};
  for (size_t k = 0; k + 5 < integral.size(); ++k) {
    const double* t = spline.knots.data() + k + 5;
    const double h = t[1] - t[0];
    for (int g = 0; g < 3; ++g) {
      const double u = h * (0.5 + 0.5 * kNode[g]), to = h - u;
      const double left = to / h / (t[1] - t[-1]), right = u / h / (t[2] - t[0]);
      const double n[3] = {left * to, left * (u + t[0] - t[-1]) + right * (t[2] - t[0] - u), right * u};
      tube::BandRow row{};
      for (size_t j = 0; j < 3; ++j)
        for (size_t i = 0; i < 4; ++i) row[j + i] += n[j] * third[k + j][i];
      for (size_t i = 0; i < 6; ++i)
        for (size_t j = i; j < 6; ++j) integral[k + i][j - i] += h * kWeight[g] / 18 * row[i] * row[j];
    }
  }
}

TubeFit::Group::Group(QuinticSpline& spline, const std::vector<TubeSample>& samples,
                      const Roughness& roughness, Free free, bool rotary)
    : spline_(spline),
      roughness_(roughness),
      first_word_(rotary ? 3 : 0),
      rotary_(rotary),
      from_(free.from),
      to_(free.to),
      inverse_(spline.coefficients.size(), 0.0),
      rhs_(spline.coefficients.size(), Point{}),
      y_(rhs_),
      share_(inverse_) {
  for (size_t i = 0; i < y_.size(); ++i)
    for (int k = 0; k < 3; ++k) y_[i].w[k] = spline.coefficients[i][first_word_ + k];
  for (size_t k = 0; k < static_cast<size_t>(spline.span_count()); ++k)
    span_.push_back(spline.knots[k + 6] - spline.knots[k + 5]);
  weight_ = energy_ = local_energy_ = span_;
  take_samples(samples);
}

void TubeFit::Group::take_samples(const std::vector<TubeSample>& samples) {
  radius_.assign(span_.size(), 1e300);
  samples_.resize(samples.size());
  next_deviation_.resize(samples.size());
  for (size_t s = 0; s < samples.size(); ++s) {
    const TubeSample& from = samples[s];
    GroupSample& to = samples_[s];
    to.front = Four{from.row[0], from.row[1], from.row[2], from.row[3]};
    to.back = Four{from.row[4], from.row[5], 0, 0};
    to.middle = to.target = Triple{};
    for (int i = 0; i < 3; ++i) {
      to.middle[i] = from.middle[first_word_ + i];
      to.target[i] = from.target[first_word_ + i];
    }
    const double radius = rotary_ ? from.radius_rad : from.radius_mm;
    to.inverse_radius2 = 1 / (radius * radius);
    to.length = from.weight;
    to.span = from.span;
    radius_[to.span] = std::min(radius_[to.span], radius);
  }
  for (size_t k = 1; k < radius_.size(); ++k)
    if (radius_[k] > 1e299) radius_[k] = radius_[k - 1];
}

// Least squares to the target: the form of P3 with the smoothing length fixed at a share of the span. It
// gives smooth() a start near the middle and, where smooth() fails, a curve that is rough but inside the
// tube.
void TubeFit::Group::follow() {
  length_ = span_;
  for (double& l : length_) l *= kFollow;
  for (size_t k = 0; k < span_.size(); ++k) weight_[k] = std::pow(length_[k], -6);
  for (GroupSample& p : samples_) {
    p.fit_target = p.target;
    p.fit_weight = p.length;
  }
  solve();
  find_deviations(samples_, y_, next_deviation_);
  accept_step();
  write_back();
}

// Newton's method on P3. The weight m follows the local mean of |y'''|^2, which depends on the curve; so m is
// renewed before every step, until both have settled.
void TubeFit::Group::smooth() {
  for (int round = 0; round < kRounds; ++round) {
    const bool settled = set_lengths();
    if (step() < kSettled && settled) break;
  }
  write_back();
}

void TubeFit::Group::tighten(const std::vector<TubeUse>& usage, double usage_max, size_t reach) {
  const size_t n = span_.size();
  std::vector<double> factor(n, 1);
  bool over = false;
  for (size_t k = 0; k < n; ++k) {
    const double used = rotary_ ? usage[k].rotary : usage[k].linear;
    if (used <= usage_max) continue;
    over = true;
    const double narrower = std::clamp(usage_max / used, kTightenMost, kTightenLeast);
    for (size_t i = k - std::min(k, reach); i < std::min(n, k + reach + 1); ++i)
      factor[i] = std::min(factor[i], narrower);
  }
  if (!over) return;
  for (GroupSample& p : samples_) p.inverse_radius2 /= factor[p.span] * factor[p.span];
  for (int i = 0; i < kTightenSteps; ++i) step();
  write_back();
}

// The barrier's weight m of P3 as a smoothing length l, m = radius^2 / l^6: against |y'''|^2, least squares
// to the middle with the weight l^-6 smooth over about that length. With m a share of the local mean e of
// |y'''|^2, l^6 = radius^2 / (2 kBarrier e). Lengths grow by a bounded factor a round, so that the curve can
// follow. True: settled.
bool TubeFit::Group::set_lengths() {
  average_energy();
  double growth = 1;
  for (size_t k = 0; k < span_.size(); ++k) {
    const double wanted =
        std::cbrt(radius_[k] * std::sqrt(1 / (2 * kBarrier * std::max(local_energy_[k], 1e-30))));
    const double before = length_[k];  // kept in local_energy_, whose value is used up
    length_[k] = std::min(wanted, before * kGrow);
    local_energy_[k] = before;
  }
  bound_lengths();
  for (size_t k = 0; k < span_.size(); ++k)
    growth = std::max({growth, length_[k] / local_energy_[k], local_energy_[k] / length_[k]});
  set_weights();
  return growth < kSettledLength;
}

// Local means of |y'''|^2, in linear time: a recursive filter along the spans and one back, each with weights
// that fall off exponentially over some smoothing lengths.
void TubeFit::Group::average_energy() {
  const size_t n = span_.size();
  const auto square = [&](size_t i) {
    const auto& w = roughness_.third[i];
    const Triple d = w[0] * y_[i].w + w[1] * y_[i + 1].w + w[2] * y_[i + 2].w + w[3] * y_[i + 3].w;
    return dot(d, d);
  };
  double a = square(0), b = square(1);
  for (size_t k = 0; k < n; ++k) {
    const double c = square(k + 2);
    energy_[k] = (a + b + c) / 3 * span_[k];
    a = b;
    b = c;
  }
  const auto kept = [&](size_t k, size_t beside) {
    return kAveraging * length_[k] / (kAveraging * length_[k] + (span_[k] + span_[beside]) / 2);
  };
  double energy = 0, length = 0;
  for (size_t k = 0; k < n; ++k) {
    const double f = k > 0 ? kept(k, k - 1) : 0;
    local_energy_[k] = energy = energy * f + energy_[k];
    share_[k] = length = length * f + span_[k];
  }
  energy = length = 0;
  for (size_t k = n; k-- > 0;) {
    const double f = k + 1 < n ? kept(k, k + 1) : 0;
    local_energy_[k] = (local_energy_[k] + energy * f) / (share_[k] + length * f);
    energy = energy * f + energy_[k];
    length = length * f + span_[k];
  }
}

void TubeFit::Group::set_weights() {
  for (size_t k = 0; k < span_.size(); ++k) {
    const double cube = length_[k] * length_[k] * length_[k];
    weight_[k] = 1 / (cube * cube);
  }
}

// Lengths of neighbouring spans differ by a bounded slope: a sudden change of the weight would show in the
// curve. Two sweeps reach the greatest lengths that keep the slope in both directions.
void TubeFit::Group::bound_lengths() {
  const size_t n = span_.size();
  for (size_t k = 0; k < n; ++k)
    length_[k] = std::clamp(length_[k], kShortest * span_[k], kLongest * span_[k]);
  for (size_t k = 1; k < n; ++k)
    length_[k] = std::min(length_[k], length_[k - 1] + kSlope * (span_[k] + span_[k - 1]) / 2);
  for (size_t k = n - 1; k-- > 0;)
    length_[k] = std::min(length_[k], length_[k + 1] + kSlope * (span_[k] + span_[k + 1]) / 2);
}

// A Newton step, shortened where it would meet the wall; returns the farthest that a sample has moved, over
// its radius.
double TubeFit::Group::step() {
  TRN_CHECK(!span_.empty());
  fit_to_barrier();
  last_ = y_;
  solve();
  find_deviations(samples_, y_, next_deviation_);
  if (!bound_step()) {
    for (size_t i = from_; i < to_; ++i) y_[i].w = last_[i].w + share_[i] * (y_[i].w - last_[i].w);
    find_deviations(samples_, y_, next_deviation_);
  }
  return accept_step();
}

double TubeFit::Group::accept_step() {
  double farthest = 0;
  for (size_t s = 0; s < samples_.size(); ++s) {
    GroupSample& p = samples_[s];
    const Triple moved = next_deviation_[s].w - p.deviation;
    farthest = std::max(farthest, dot(moved, moved) * p.inverse_radius2);
    p.deviation = next_deviation_[s].w;
  }
  return std::sqrt(farthest);
}

// How much of the step each coefficient may take so that no sample meets the wall: the six of a sample near
// it take the share that leads just short of the wall (a root of |deviation + share d| = radius); from there
// the share grows by a factor a coefficient. True: all of the step.
bool TubeFit::Group::bound_step() {
  bool whole = true;
  for (size_t s = 0; s < samples_.size(); ++s) {
    const GroupSample& p = samples_[s];
    const double used = dot(p.deviation, p.deviation) * p.inverse_radius2;
    if (used >= 1 || dot(next_deviation_[s].w, next_deviation_[s].w) * p.inverse_radius2 < 1) continue;
    if (whole) std::fill(share_.begin(), share_.end(), 1.0);
    whole = false;
    const Triple d = next_deviation_[s].w - p.deviation;
    const double dd = dot(d, d) * p.inverse_radius2, od = dot(p.deviation, d) * p.inverse_radius2;
    const double to_wall = (std::sqrt(od * od + dd * (1 - used)) - od) / dd;
    const double share = std::max(kLeastStep, kToWall * to_wall);
    for (size_t i = p.span; i < p.span + 6; ++i) share_[i] = std::min(share_[i], share);
  }
  if (whole) return true;
  for (size_t i = 1; i < share_.size(); ++i) share_[i] = std::min(share_[i], kStepGrowth * share_[i - 1]);
  for (size_t i = share_.size() - 1; i-- > 0;) share_[i] = std::min(share_[i], kStepGrowth * share_[i + 1]);
  return false;
}

// The Newton step of the barrier -log(1 - |y - middle|^2 / radius^2) as a least-squares term: fit_weight is
// the barrier's second derivative along the deviation, fit_target the place where its slope would vanish.
// Across the deviation the barrier is less curved. Taking the same curvature for all directions makes the
// step a little shorter, and leaves one matrix for all three words.
void TubeFit::Group::fit_to_barrier() {
  for (GroupSample& p : samples_) {
    const double used = dot(p.deviation, p.deviation) * p.inverse_radius2, room = 1 - used;
    double slope = 1 / room, curvature = slope * slope;
    if (room < kWall) {  // the parabola that continues the barrier with its value, slope and curvature
      slope = (2 - room / kWall) / kWall;
      curvature = 1 / (kWall * kWall);
    }
    const double both = slope + 2 * curvature * used;
    p.fit_weight = p.length * both;
    p.fit_target = p.middle + (1 - slope / both) * p.deviation;
  }
}

// The minimum of the quadratic form: a symmetric system of bandwidth 6, one matrix for three right sides.
// Coefficients outside of [from_, to_) are given; their products go to the right side.
void TubeFit::Group::solve() {
  band_ = roughness_.integral;
  std::fill(rhs_.begin(), rhs_.end(), Point{});
  add_fit_terms(samples_, weight_, band_, rhs_);
  for (size_t i = from_ - std::min<size_t>(from_, 5); i < from_; ++i)
    for (size_t k = from_ - i; k < 6 && i + k < to_; ++k) rhs_[i + k].w -= band_[i][k] * y_[i].w;
  for (size_t j = to_; j < std::min(y_.size(), to_ + 5); ++j)
    for (size_t k = j - to_ + 1; k < 6 && k <= j; ++k) rhs_[j - k].w -= band_[j - k][k] * y_[j].w;
  factorise();
  for (size_t i = from_; i < to_; ++i)
    for (size_t k = 1; k < 6 && i + k < to_; ++k) rhs_[i + k].w -= band_[i][k] * rhs_[i].w;
  for (size_t i = to_; i-- > from_;) {
    Triple y = rhs_[i].w * inverse_[i];
    for (size_t k = 1; k < 6 && i + k < to_; ++k) y -= band_[i][k] * y_[i + k].w;
    y_[i].w = y;
  }
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

void TubeFit::Group::write_back() {
  for (size_t i = from_; i < to_; ++i)
    for (int k = 0; k < 3; ++k) spline_.coefficients[i][first_word_ + k] = y_[i].w[k];
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
  const Roughness roughness(spline);
  for (const bool rotary : {false, true})
    if (moves(samples, rotary ? 3 : 0)) groups_.emplace_back(spline, samples, roughness, free, rotary);
}

void TubeFit::follow() {
  for (Group& group : groups_) group.follow();
}

void TubeFit::smooth() {
  for (Group& group : groups_) group.smooth();
}

void TubeFit::tighten(const std::vector<TubeUse>& usage, double usage_max, size_t reach) {
  for (Group& group : groups_) group.tighten(usage, usage_max, reach);
}

}  // namespace trn

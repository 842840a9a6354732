#include "app/check/limit_judge.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/check.h"

namespace trn {

const char* to_string(Quantity quantity) {
  static constexpr std::array<const char*, kQuantityCount> kNames = {"position", "velocity", "acceleration",
                                                                     "jerk"};
  return kNames[static_cast<std::size_t>(quantity)];
}

LimitJudge::LimitJudge(const Joints& joints, double step_s)
    : joints_(joints), step_s_(step_s), history_(joints.size()), verdicts_(joints.size()) {}

void LimitJudge::offer(std::size_t joint, Quantity quantity, double value, double ratio, double t_s,
                       std::uint32_t line) {
  Peak& peak = verdicts_[joint].peaks[static_cast<std::size_t>(quantity)];
  if (ratio > kRatioMax) ++peak.over;
  if (!(ratio > peak.ratio)) return;
  peak.value = value;
  peak.ratio = ratio;
  peak.t_s = t_s;
  peak.line = line;
}

void LimitJudge::judge(std::size_t joint, double q, double t_s, std::uint32_t line) {
  const JointLimit& limit = joints_[joint].limit;
  const auto [velocity, acceleration, jerk] = history_[joint].q.next(q, step_s_);
  offer(joint, Quantity::kVelocity, velocity, std::abs(velocity) / limit.velocity, t_s, line);
  offer(joint, Quantity::kAcceleration, acceleration, std::abs(acceleration) / limit.acceleration, t_s, line);
  offer(joint, Quantity::kJerk, jerk, std::abs(jerk) / limit.jerk, t_s, line);
}

void LimitJudge::row(const TraceRow& row) {
  TRN_CHECK(row.q.size() >= joints_.size() && row.digits.size() >= joints_.size());
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    History& past = history_[i];
    const double q = row.q[i];
    // A new piece begins at rest where its first row is: differences across the pause between two pieces
    // would be no motion of the plan.
    if (fresh_) past.q.restart();
    past.q_abs_max = std::max(past.q_abs_max, std::abs(q));
    digits_max_.decimals = std::max(digits_max_.decimals, row.digits[i].decimals);
    digits_max_.significant = std::max(digits_max_.significant, row.digits[i].significant);
    const JointLimit& limit = joints_[i].limit;
    // The ratio of a place is its distance from the middle over half of the range, so 1 is either end.
    const double middle = (limit.max + limit.min) / 2, half = (limit.max - limit.min) / 2;
    const double ratio = std::abs(q - middle) / half;
    // A joint that stands outside where a piece begins, as behind homing at its end, may stay and come in.
    if (fresh_) past.farthest = std::max(1.0, ratio);
    offer(i, Quantity::kPosition, q, ratio / past.farthest, row.t_s, row.line);
    past.farthest = std::max(1.0, std::min(past.farthest, ratio));
    judge(i, q, row.t_s, row.line);
  }
  ++rows_;
  fresh_ = false;
  t_last_s_ = row.t_s;
  line_last_ = row.line;
}

// Half a unit of the last digit of the joint's largest value. Writers use a fixed number of decimals or of
// significant digits, the same in every column; the coarser reading is the true one.
double LimitJudge::rounding(std::size_t joint) const {
  const double largest = history_[joint].q_abs_max;
  if (largest == 0) return 0;
  const double ulp = std::nextafter(largest, std::numeric_limits<double>::infinity()) - largest;
  const double fixed = std::pow(10.0, -digits_max_.decimals);
  const double floating = std::pow(10.0, std::floor(std::log10(largest)) + 1 - digits_max_.significant);
  return 0.5 * std::max({ulp, fixed, floating});
}

void LimitJudge::finish() {
  const double h = step_s_;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    // At rest behind the end: three more rows of the same place show what the last rows ask for in velocity,
    // acceleration and jerk.
    for (int k = 1; k <= 3; ++k) judge(i, history_[i].q.value(), t_last_s_ + k * h, line_last_);
    const JointLimit& limit = joints_[i].limit;
    const double half_digit = rounding(i);
    auto& peaks = verdicts_[i].peaks;
    peaks[0].resolution_ratio = half_digit / ((limit.max - limit.min) / 2);
    // Differences of order n weigh rounded values with the binomial coefficients, whose absolute values add
    // up to 2^n.
    peaks[1].resolution_ratio = 2 * half_digit / h / limit.velocity;
    peaks[2].resolution_ratio = 4 * half_digit / (h * h) / limit.acceleration;
    peaks[3].resolution_ratio = 8 * half_digit / (h * h * h) / limit.jerk;
  }
}

bool LimitJudge::within_limits() const {
  return std::all_of(verdicts_.begin(), verdicts_.end(), [](const JointVerdict& verdict) {
    return std::all_of(verdict.peaks.begin(), verdict.peaks.end(),
                       [](const Peak& peak) { return peak.ratio <= kRatioMax; });
  });
}

}  // namespace trn

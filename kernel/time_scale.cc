#include "kernel/time_scale.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace trn {

namespace {
constexpr double kFollow = 0.9;  // share of |r''| used by the curves, the rest is for following them in steps
constexpr double kCurve = 0.75;  // share of the jerk budget that speed may take, the rest is for r''
// Of the distance from the target that a period may take. The place ahead knows of the speed before only:
// with all of it the speed's sign would change for ever, with this share both errors shrink to 0.58 in a
// period.
constexpr double kLastShare = 2.0 / 3;
constexpr double kSnapRate = 1e-7;  // smaller steps of the rate are far below the jerk reserve
}  // namespace

TimeScale::TimeScale(const Joints& joints, PlanShares shares, double period_s)
    : alpha_(shares.acceleration), beta_(shares.jerk), period_s_(period_s) {
  TRN_CHECK(shares.acceleration > 0 && shares.acceleration < 1);
  TRN_CHECK(shares.jerk > 0 && shares.jerk < 1);
  TRN_CHECK(shares.velocity > 0 && shares.velocity <= 1);
  for (const Joint& joint : joints) {
    const JointLimit& limit = joint.limit;
    const double velocity = shares.velocity * limit.velocity;
    k_a_ = std::max(k_a_, velocity / limit.acceleration);
    k_aj_ = std::max(k_aj_, limit.acceleration / limit.jerk);
    k_j_ = std::max(k_j_, velocity / limit.jerk);
  }
  // w(r): the largest speed from which both ends, r = 0 and r = 1, can be reached or were reached within the
  // bounds; a forward and a backward sweep over z = w^2, whose slope is 2 r''.
  const double h = 1.0 / kCells;
  std::array<double, kCells + 1> cap{};
  for (int i = 0; i <= kCells; ++i) {
    const double r = i * h;
    const double by_acceleration = 0.98 * (1 - alpha_ * r * r) / k_a_;
    const double by_jerk =
        r > 0 ? kCurve * (1 - beta_ * r * r * r) / (3 * r * alpha_ * k_aj_) : by_acceleration;
    cap[static_cast<size_t>(i)] = std::min(by_acceleration, by_jerk);
  }
  const auto sweep = [&](int from, int to, int step) {
    double z = 0;
    speed_[static_cast<size_t>(from)] = 0;
    for (int i = from; i != to; i += step) {
      const auto next = static_cast<size_t>(i + step);
      const double r_worst = h * std::max(i, i + step);
      double w = std::min(cap[next], speed_[next]);
      for (int k = 0; k < 8; ++k)
        w = std::min(w,
                     std::sqrt(z + 2 * h * kFollow * acceleration_limit(r_worst, std::max(w, std::sqrt(z)))));
      speed_[next] = w;
      z = w * w;
    }
  };
  speed_ = cap;
  sweep(0, kCells, 1);
  sweep(kCells, 0, -1);
}

void TimeScale::set_target(double rate) TRN_RT { target_ = std::clamp(rate, 0.0, 1.0); }

double TimeScale::step() TRN_RT {
  const double T = period_s_;
  const double old_rate = rate_, old_slope = slope_;
  const double distance = target_ - rate_;
  if (std::abs(distance) <= kSnapRate && std::abs(slope_) * T <= kSnapRate) {
    rate_ = target_;
    slope_ = 0;
    return rate_ * T;
  }
  const double ahead = std::clamp(rate_ + slope_ * T, 0.0, 1.0);
  const double worst_rate = std::max(old_rate, ahead);
  const double growth = T * acceleration_limit(worst_rate, std::abs(old_slope));
  const double bound = 0.98 * T * acceleration_limit(worst_rate, std::abs(old_slope) + growth);
  const double sign = target_ >= ahead ? 1.0 : -1.0;
  // The curve is zero at both ends; one step of full acceleration further it lets the rate leave them.
  const double curve = std::max(speed_limit(ahead), speed_limit(ahead + sign * bound * T / 2));
  const double wanted = sign * std::min(curve, approach_speed(std::abs(target_ - ahead)));
  slope_ = old_slope + std::clamp(wanted - old_slope, -bound, bound);
  rate_ = old_rate + T * (old_slope + slope_) / 2;
  if (rate_ >= 1 || rate_ <= 0) {
    rate_ = std::clamp(rate_, 0.0, 1.0);
    slope_ = 0;
  }
  const double curvature = (slope_ - old_slope) / T;
  TRN_CHECK(rate_ >= 0 && rate_ <= 1);
  return T * (old_rate + T * (old_slope / 2 + T * curvature / 6));
}

void TimeScale::restart() TRN_RT {
  rate_ = target_;
  slope_ = 0;
}

double TimeScale::speed_limit(double rate) const TRN_RT {
  const double x = std::clamp(rate, 0.0, 1.0) * kCells;
  const auto i = static_cast<size_t>(std::min<double>(kCells - 1, std::floor(x)));
  const double f = x - static_cast<double>(i);
  const double z0 = speed_[i] * speed_[i], z1 = speed_[i + 1] * speed_[i + 1];
  return std::sqrt(z0 + f * (z1 - z0));
}

double TimeScale::acceleration_limit(double rate, double speed) const TRN_RT {
  const double spare = 1 - beta_ * rate * rate * rate - 3 * rate * speed * alpha_ * k_aj_;
  return std::max(spare, 0.0) / k_j_;
}

double TimeScale::approach_speed(double distance) const TRN_RT {
  if (target_ == 0 || target_ == 1) return 1 / period_s_;  // the curve itself ends there
  // w^2 = 2 d R(w), with half the bound R taken where the rate is higher: it is the smallest there.
  const double r = std::max(rate_, target_);
  const double spare = 1 - beta_ * r * r * r, drag = 3 * r * alpha_ * k_aj_;
  const double half = distance * drag / k_j_ / 2;
  return std::min(std::sqrt(half * half + distance * spare / k_j_) - half, kLastShare * distance / period_s_);
}

}  // namespace trn

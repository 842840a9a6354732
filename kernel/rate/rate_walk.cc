#include "kernel/rate/rate_walk.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace trn {

namespace {

constexpr int kSkippedMax = 512;            // segments at once; the path has hardly more in the longest skip
constexpr double kAccelerationUse = 0.999;  // the rest is for what lies between a step's ends
constexpr double kJerkUse = 0.996;
constexpr double kVelocityUse = 0.9999;
constexpr double kSpeedError = 3e-5;  // of a velocity in JointMotion, over the limit
constexpr double kRateChange = 0.02;  // in a step, for the same reason
constexpr double kBulge = 0.0006;     // of 3 r r' a between a step's ends, r' and a running apart
constexpr double kSlow = 1e-3;
constexpr double kBriskness = 0.04;  // of u times period squared, where hardly anything moves
constexpr double kRounding = 1e-6;
constexpr double kRoundingS = 1e-12;

}  // namespace

PlanLimits::PlanLimits(const Joints& joints, double period_s) : count(static_cast<int>(joints.size())) {
  TRN_CHECK(period_s > 0);
  TRN_CHECK(joints.size() <= kMaxJoints);
  double ramp = 1;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const JointLimit& limit = joints[i].limit;
    acceleration[i] = limit.acceleration / limit.jerk;
    velocity[i] = limit.velocity / limit.jerk;
    ramp = std::min(ramp, acceleration[i]);
  }
  u_max = kBriskness / (period_s * period_s);
  step_s_max = std::max(period_s, ramp / 20);
}

RateWalk::RateWalk(const PlanLimits& limits, const MotionQueue::View& blocks, const PlanPlace& place,
                   double rate, double slope)
    : limits_(&limits), blocks_(blocks), place_(place), rate_(rate), slope_(slope) {
  block_ = blocks.at(place.block);
  ended_ = !block_ || block_->segment_count == 0;
  TRN_CHECK(rate >= -kRounding);
  TRN_CHECK(ended_ || place.segment < block_->segment_count);
  if (!ended_ && place_.time_s >= block_->segments[static_cast<std::size_t>(place_.segment)].duration_s)
    leave_segment();
}

void RateWalk::leave_segment() {
  TRN_CHECK(block_ != nullptr);
  place_.time_s = 0;
  judged_ = false;
  if (++place_.segment < block_->segment_count) return;
  ended_ = block_->ends_at_rest;
  place_.segment = 0;
  block_ = blocks_.at(++place_.block);
}

void RateWalk::coast(double duration_s, double u) {
  skip(std::max(0.0, duration_s * (rate_ + duration_s * (slope_ / 2 + duration_s * u / 6))));
  rate_ = std::max(0.0, rate_ + duration_s * (slope_ + duration_s * u / 2));
  slope_ += duration_s * u;
  judged_ = false;
}

void RateWalk::skip(double plan_time_s) {
  judged_ = false;
  place_.time_s += plan_time_s;
  passed_s_ += plan_time_s;
  for (int i = 0; i < kSkippedMax && !ended_ && block_; ++i) {
    const double beyond =
        place_.time_s - block_->segments[static_cast<std::size_t>(place_.segment)].duration_s;
    if (beyond < 0) return;
    leave_segment();
    place_.time_s = beyond;
  }
  if (!ended_) block_ = nullptr;  // so far ahead nothing is known
}

RateBounds RateWalk::judge() const {
  const double r = rate_, w = slope_, rr = r * r, rrr = rr * r, rw3 = 3 * r * w;
  RateBounds out{-limits_->u_max, limits_->u_max, -1e9, 1e9, block_ != nullptr, limits_->u_max};
  if (!block_) return out;
  TRN_CHECK(place_.segment < block_->segment_count);
  const auto k = static_cast<std::size_t>(place_.segment);
  const JointMotion& joints = block_->joints[k];
  const double t = place_.time_s, duration = block_->segments[k].duration_s, half = t / (2 * duration);
  TRN_CHECK(duration > 0);
  for (std::size_t i = 0; i < static_cast<std::size_t>(limits_->count); ++i) {
    const double a0 = joints.a[i], da = joints.a_end[i] - a0;
    const double a = a0 + 2 * half * da, v = joints.v[i] + t * (a0 + half * da);
    const double a_error = duration * (joints.j_max[i] - joints.j_min[i]) / 4;  // off its chord
    const double speed_error = kSpeedError * limits_->velocity[i] + duration * a_error;
    const double speed = std::abs(v) + speed_error;
    const double jerk_use = kJerkUse - std::abs(rw3) * a_error;
    const double up = jerk_use - (joints.j_max[i] * rrr + rw3 * a);
    const double down = jerk_use + (joints.j_min[i] * rrr + rw3 * a);
    const double A = kAccelerationUse * limits_->acceleration[i] - a_error * rr, held = a * rr;
    if (speed * r > kVelocityUse * limits_->velocity[i] && r > 1) out.legal = false;
    // What is left of a limit is divided by the greatest speed, what is lacking by the least.
    const double most = 1 / speed, least = 1 / std::max(std::abs(v) - speed_error, kRounding * speed_error);
    out.u_still = std::min(out.u_still, kJerkUse * most);
    const auto bound = [&](double left) { return std::min(left * most, left * least); };
    const bool forward = v > 0;
    out.u_max = std::min(out.u_max, bound(forward ? up : down));
    out.u_min = std::max(out.u_min, -bound(forward ? down : up));
    out.slope_max = std::min(out.slope_max, bound(forward ? A - held : A + held));
    out.slope_min = std::max(out.slope_min, -bound(forward ? A + held : A - held));
  }
  if (out.u_min > out.u_max) out.legal = false;  // what one joint needs breaks another's limit
  return out;
}

// Rapid moves, and moves without feed override, go as planned at most, from their first moment on.
bool RateWalk::goes_too_fast() const {
  if (!block_ || ended_ || rate_ <= 1 + kRounding) return false;
  return block_->rapid || !(block_->overrides.feed || block_->overrides.follows_spindle());
}

double RateWalk::step(double u, double duration_s) {
  if (!block_) return -1;
  const auto travel = [&](double t) { return t * (rate_ + t * (slope_ / 2 + t * (u / 6))); };
  const double left = block_->segments[static_cast<std::size_t>(place_.segment)].duration_s - place_.time_s;
  double dt = std::min({duration_s, limits_->step_s_max, kRateChange / (std::abs(slope_) + kSlow),
                        std::sqrt(kBulge / (std::abs(u) + kSlow))});
  double gone_s = travel(dt);
  const bool leaves = gone_s >= left - kRoundingS;
  if (leaves) {
    double low = 0, high = dt;
    dt = gone_s > 0 ? dt * left / gone_s : 0;
    for (int i = 0; i < 6; ++i) {  // Newton, kept inside the bracket
      const double error = travel(dt) - left, speed = rate_ + dt * (slope_ + dt * u / 2);
      if (std::abs(error) < kRoundingS) break;
      (error > 0 ? high : low) = dt;
      const double next = dt - error / speed;
      dt = speed > 0 && next > low && next < high ? next : (low + high) / 2;
    }
    gone_s = left;
  }
  rate_ += dt * (slope_ + dt * u / 2);
  slope_ += dt * u;
  place_.time_s += gone_s;
  passed_s_ += gone_s;
  here_ = judge();
  judged_ = true;
  const RateBounds end = here_;
  const double tolerance = kRounding * (end.u_max - end.u_min) + kRounding;
  if (rate_ < 0 && rate_ > -kRoundingS) rate_ = 0;
  if (!end.legal || rate_ < 0 || u < end.u_min - tolerance || u > end.u_max + tolerance) return -1;
  if (slope_ < end.slope_min || slope_ > end.slope_max || goes_too_fast()) return -1;
  if (leaves) leave_segment();
  return goes_too_fast() ? -1 : dt;
}

bool RateWalk::run(double u, double duration_s, RateStep* steps, int& count) {
  TRN_CHECK(count >= 0 && count <= RatePlan::kStepsMax);
  while (duration_s > kRoundingS && !ended_) {
    if (count == RatePlan::kStepsMax) return false;
    const RateBounds start = bounds();
    const double tolerance = kRounding * (start.u_max - start.u_min) + kRounding;
    if (!start.legal || u < start.u_min - tolerance || u > start.u_max + tolerance) return false;
    const double gone = step(u, duration_s);
    if (gone < 0) return false;
    steps[count++] = {gone, u};
    duration_s -= gone;
  }
  return true;
}

}  // namespace trn

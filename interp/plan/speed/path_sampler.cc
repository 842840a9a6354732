#include "interp/plan/speed/path_sampler.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/units.h"

namespace trn::speed {

namespace {

constexpr double kTiny = 1e-12;  // a derivative below this (mm or rad per unit of s) does not move the joint

[[noreturn]] void fail_position(const PlanPiece& piece, const Joint& joint, double q) {
  const bool high = q > joint.limit.max;
  const double limit = high ? joint.limit.max : joint.limit.min;
  const bool rotary = joint.kind == JointKind::kRotary;
  const double unit = rotary ? kDegPerRad : 1.0;
  throw ProgramError(fmt::format("line {}: joint {} would reach {:.4f} {}, {} its {} limit of {:.4f} {}",
                                 piece.line, joint.name, q * unit, rotary ? "deg" : "mm",
                                 high ? "above" : "below", high ? "upper" : "lower", limit * unit,
                                 rotary ? "deg" : "mm"));
}

}  // namespace

JointRates joint_rates(const Joints& joints, double acceleration_share, double jerk_share) {
  JointRates rates;
  rates.count = static_cast<int>(joints.size());
  for (size_t i = 0; i < joints.size(); ++i) {
    rates.velocity[i] = joints[i].limit.velocity;
    rates.acceleration[i] = joints[i].limit.acceleration * acceleration_share;
    rates.jerk[i] = joints[i].limit.jerk * jerk_share;
    rates.acceleration_inverse[i] = 1 / rates.acceleration[i];
    rates.jerk_inverse[i] = 1 / rates.jerk[i];
  }
  return rates;
}

PathSampler::PathSampler(const Joints& joints, const JointMap& map, const JointRates& rates)
    : joints_(joints), map_(map), rates_(rates) {}

void PathSampler::check_position(const PlanPiece& piece, const JointDerivatives& d, double reach) const {
  for (int i = 0; i < rates_.count; ++i) {
    const JointLimit& limit = joints_[static_cast<size_t>(i)].limit;
    double low = d.q[i], high = d.q[i];
    const double to_turn = std::abs(d.d2[i]) > kTiny ? -d.d1[i] / d.d2[i] : reach;
    if (std::abs(to_turn) < reach) {  // the joint turns back between this sample and the next
      const double q_turn = d.q[i] + d.d1[i] * to_turn / 2;
      low = std::min(low, q_turn);
      high = std::max(high, q_turn);
    }
    const double rounding = 1e-9;
    if (high > limit.max + rounding) fail_position(piece, joints_[static_cast<size_t>(i)], high);
    if (low < limit.min - rounding) fail_position(piece, joints_[static_cast<size_t>(i)], low);
  }
}

double PathSampler::speed_bound(const PlanPiece& piece, const JointDerivatives& d) const {
  double speed = d.feed_speed;
  if (!(speed > 0))
    throw ProgramError(fmt::format("line {}: the feed is zero; give a positive F word", piece.line));
  for (int i = 0; i < rates_.count; ++i) {
    const double d1 = std::abs(d.d1[i]);
    if (d1 > kTiny) speed = std::min(speed, rates_.velocity[static_cast<size_t>(i)] / d1);
  }
  if (!std::isfinite(speed)) speed = 1e6;  // nothing moves and nothing binds
  return speed * speed;
}

PathSample PathSampler::sample(const PlanPiece& piece, double s_piece, double s, double reach) const {
  JointDerivatives d;
  const KinStatus status = joint_derivatives(map_, piece, s_piece, d);
  if (status != KinStatus::kOk) {
    const Words y = piece.piece.at(s_piece);
    throw ProgramError(fmt::format(
        "line {}: the machine cannot reach X{:.4f} Y{:.4f} Z{:.4f} A{:.4f} B{:.4f} C{:.4f}: {}", piece.line,
        y[kX], y[kY], y[kZ], y[kA] * kDegPerRad, y[kB] * kDegPerRad, y[kC] * kDegPerRad, to_string(status)));
  }
  check_position(piece, d, reach);
  PathSample out;
  out.s = s;
  out.b_max = speed_bound(piece, d);
  for (int i = 0; i < rates_.count; ++i) {
    const auto k = static_cast<size_t>(i);
    out.d1[k] = d.d1[i];
    out.d2[k] = d.d2[i];
    out.d3[k] = d.d3[i];
  }
  if (std::isfinite(piece.feed.tip_mm_s2)) weigh(piece, s_piece, out);
  return out;
}

// Where the program asks for less acceleration than the joints have, they count as so much weaker, in jerk
// too.
void PathSampler::weigh(const PlanPiece& piece, double s_piece, PathSample& out) const {
  const double tip = piece.piece.derivatives(s_piece).d1.head<3>().norm();
  const double weaker = bound(out).acceleration * tip / piece.feed.tip_mm_s2;
  if (!(weaker > 1)) return;
  for (PerJoint* d : {&out.d1, &out.d2, &out.d3})
    for (double& value : *d) value *= weaker;
}

LocalBound PathSampler::bound(const PathSample& sample) const {
  LocalBound out{sample.b_max, 1e12, 1e15};
  for (size_t i = 0; i < static_cast<size_t>(rates_.count); ++i) {
    const double d1 = std::abs(sample.d1[i]), d2 = std::abs(sample.d2[i]), d3 = std::abs(sample.d3[i]);
    if (d1 > kTiny) {
      out.acceleration = std::min(out.acceleration, rates_.acceleration[i] / d1);
      out.jerk = std::min(out.jerk, rates_.jerk[i] / d1);
    }
    if (d2 * out.b > rates_.acceleration[i]) out.b = rates_.acceleration[i] / d2;
    if (d3 * out.b * std::sqrt(out.b) > rates_.jerk[i]) out.b = std::pow(rates_.jerk[i] / d3, 2.0 / 3.0);
  }
  return out;
}

}  // namespace trn::speed

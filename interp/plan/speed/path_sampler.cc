#include "interp/plan/speed/path_sampler.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/units.h"

namespace trn::speed {

namespace {

constexpr double kCurveTold = 5e-4;   // of a limit: how well polynomials must tell the joints' bracket
constexpr double kCurveFaster = 1.5;  // the (ds/dt)^2 that is possible, against the bounds at three places
constexpr int kHalvingsMax = 3;       // of a piece into panels
constexpr double kTiny = 1e-12;       // share of a limit below which nothing moves

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
    rates.velocity_inverse[i] = 1 / rates.velocity[i];
    rates.acceleration_inverse[i] = 1 / rates.acceleration[i];
    rates.jerk_inverse[i] = 1 / rates.jerk[i];
  }
  return rates;
}

PathSampler::PathSampler(const Joints& joints, const JointMap& map, const JointRates& rates)
    : joints_(joints), map_(map), rates_(rates) {}

void PathSampler::curve(const PlanPiece& piece, JointCurve& out) const {
  out.clear();
  add_panels(piece, 0, piece.piece.length, kHalvingsMax, out);
}

void PathSampler::add_panels(const PlanPiece& piece, double s0, double s1, int halvings,
                             JointCurve& curve) const {
  JointPanel& panel = curve.emplace_back();
  const bool found = panel.interpolate(map_, piece, s0, s1);
  if (found && tells(piece, panel)) return;
  const bool shorter = halvings > 0 && found && !panel.rounding();
  curve.pop_back();
  if (!shorter) return;
  const double middle = (s0 + s1) / 2;
  add_panels(piece, s0, middle, halvings - 1, curve);
  add_panels(piece, middle, s1, halvings - 1, curve);
}

// What the panel may be off by is little against the limits, as fast as the machine may be.
bool PathSampler::tells(const PlanPiece& piece, const JointPanel& panel) const {
  double b = 0;
  for (const double s : {panel.s0(), (panel.s0() + panel.s1()) / 2, panel.s1()}) {
    Bracket d;
    panel.at(s, d);
    b = std::max(b, bound({s, speed_bound(piece, d, s), d.d1, d.d2, d.d3}).b);
  }
  b *= kCurveFaster;
  for (size_t i = 0; i < static_cast<size_t>(rates_.count); ++i) {
    if (!(b * panel.error2()[i] <= kCurveTold * rates_.acceleration[i])) return false;
    if (!(b * std::sqrt(b) * panel.error3()[i] <= kCurveTold * rates_.jerk[i])) return false;
  }
  return true;
}

void PathSampler::check_position(const PlanPiece& piece, const Bracket& d, double reach) const {
  for (size_t i = 0; i < static_cast<size_t>(rates_.count); ++i) {
    const JointLimit& limit = joints_[i].limit;
    double low = d.q[i], high = d.q[i];
    if (std::abs(d.d1[i]) < reach * std::abs(d.d2[i])) {  // the joint turns back before the next sample
      const double q_turn = d.q[i] - d.d1[i] * d.d1[i] / d.d2[i] / 2;
      low = std::min(low, q_turn);
      high = std::max(high, q_turn);
    }
    const double rounding = 1e-9;
    if (high > limit.max + rounding) fail_position(piece, joints_[i], high);
    if (low < limit.min - rounding) fail_position(piece, joints_[i], low);
  }
}

double PathSampler::speed_bound(const PlanPiece& piece, const Bracket& d, double s_piece) const {
  double speed = feed_speed(piece, s_piece);
  if (!(speed > 0))
    throw ProgramError(fmt::format("line {}: the feed is zero; give a positive F word", piece.line));
  double share = 1 / speed;
  for (size_t i = 0; i < static_cast<size_t>(rates_.count); ++i)
    share = std::max(share, std::abs(d.d1[i]) * rates_.velocity_inverse[i]);
  speed = share > kTiny ? 1 / share : 1e6;  // then nothing moves and nothing binds
  return speed * speed;
}

// By the joint map itself.
Bracket PathSampler::ask(const PlanPiece& piece, double s_piece) const {
  JointDerivatives d;
  const KinStatus status = joint_derivatives(map_, piece, s_piece, d);
  if (status != KinStatus::kOk) {
    const Words y = piece.piece.at(s_piece);
    throw ProgramError(fmt::format(
        "line {}: the machine cannot reach X{:.4f} Y{:.4f} Z{:.4f} A{:.4f} B{:.4f} C{:.4f}: {}", piece.line,
        y[kX], y[kY], y[kZ], y[kA] * kDegPerRad, y[kB] * kDegPerRad, y[kC] * kDegPerRad, to_string(status)));
  }
  Bracket out;
  for (int i = 0; i < rates_.count; ++i) {
    const auto k = static_cast<size_t>(i);
    out.q[k] = d.q[i];
    out.d1[k] = d.d1[i];
    out.d2[k] = d.d2[i];
    out.d3[k] = d.d3[i];
  }
  return out;
}

PathSample PathSampler::sample(const PlanPiece& piece, const JointCurve& curve, double s_piece, double s,
                               double reach) const {
  Bracket d;
  if (const JointPanel* panel = panel_at(curve, s_piece))
    panel->at(s_piece, d);
  else
    d = ask(piece, s_piece);
  check_position(piece, d, reach);
  PathSample out{s, speed_bound(piece, d, s_piece), d.d1, d.d2, d.d3};
  if (std::isfinite(piece.feed.tip_mm_s2)) weigh(piece, s_piece, out);
  return out;
}

bool PathSampler::parabolas_tell(const PlanPiece& piece, const JointCurve& curve, double s0, double s1,
                                 double step, double b, double share) const {
  const JointPanel* const panel = panel_at(curve, (s0 + s1) / 2);
  if (panel == nullptr || s0 < panel->s0() || s1 > panel->s1() || std::isfinite(piece.feed.tip_mm_s2))
    return false;
  // Lagrange's remainder: the third derivative over 6, times step / 2, step / 2 and 3 step / 2.
  const double off = b * step * step * step / 16, off3 = off * std::sqrt(b);
  for (size_t i = 0; i < static_cast<size_t>(rates_.count); ++i)
    if (off * panel->bend5()[i] > share * rates_.acceleration[i] ||
        off3 * panel->bend6()[i] > share * rates_.jerk[i])
      return false;
  return true;
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
  double a1 = 1e-12, a2 = 1 / sample.b_max, j1 = 1e-15, j3 = 0;
  for (size_t i = 0; i < static_cast<size_t>(rates_.count); ++i) {
    const double d1 = std::abs(sample.d1[i]);
    a1 = std::max(a1, d1 * rates_.acceleration_inverse[i]);
    j1 = std::max(j1, d1 * rates_.jerk_inverse[i]);
    a2 = std::max(a2, std::abs(sample.d2[i]) * rates_.acceleration_inverse[i]);
    j3 = std::max(j3, std::abs(sample.d3[i]) * rates_.jerk_inverse[i]);
  }
  const double b = 1 / a2;
  return {j3 * b * std::sqrt(b) > 1 ? 1 / std::cbrt(j3 * j3) : b, 1 / a1, 1 / j1};
}

}  // namespace trn::speed

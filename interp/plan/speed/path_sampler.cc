#include "interp/plan/speed/path_sampler.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/units.h"
#include "interp/move.h"

namespace trn::speed {

namespace {

constexpr double kCurveAccuracy = 5e-4;  // of a limit: error that a panel of polynomials may have
constexpr double kBoundMargin = 1.5;   // (ds/dt)^2 possible in a panel over the bounds at three places of it
constexpr int kPanelHalvingsMax = 3;   // of a piece into panels
constexpr int kTurnSteps = 4;          // of Newton's method, from a parabola to where a joint turns back
constexpr double kRounding = 1e-9;     // of a position, mm or rad
constexpr double kTinyShare = 1e-12;   // share of a limit below which nothing moves
constexpr double kNothingBinds = 1e6;  // ds/dt where neither feed nor a joint bounds it

[[noreturn]] void fail_position(const PlanPiece& piece, const Joint& joint, double q) {
  const bool high = q > joint.limit.max;
  const double limit = high ? joint.limit.max : joint.limit.min;
  const bool rotary = joint.kind == JointKind::kRotary;
  const double unit = rotary ? kDegPerRad : 1.0;
  throw ProgramError(fmt::format("line {}: joint {} would reach {:.4f} {}, {} its {} limit of {:.4f} {}",
                                 piece.source.line, joint.name, q * unit, rotary ? "deg" : "mm",
                                 high ? "above" : "below", high ? "upper" : "lower", limit * unit,
                                 rotary ? "deg" : "mm"));
}

}  // namespace

// Lagrange's weights; the bound of speed is interpolated as the derivatives are.
PathSample interpolate(const PathSample* p, double s, int count) {
  TRN_CHECK(p[0].s < p[1].s && p[1].s < p[2].s);
  const double a = s - p[0].s, b = s - p[1].s, c = s - p[2].s;
  const double ab = p[0].s - p[1].s, ac = p[0].s - p[2].s, bc = p[1].s - p[2].s;
  const double w0 = b * c / (ab * ac), w1 = -a * c / (ab * bc), w2 = a * b / (ac * bc);
  PathSample out;
  out.s = s;
  out.b_max = w0 * p[0].b_max + w1 * p[1].b_max + w2 * p[2].b_max;
  for (size_t j = 0; j < static_cast<size_t>(count); ++j) {
    out.d1[j] = w0 * p[0].d1[j] + w1 * p[1].d1[j] + w2 * p[2].d1[j];
    out.d2[j] = w0 * p[0].d2[j] + w1 * p[1].d2[j] + w2 * p[2].d2[j];
    out.d3[j] = w0 * p[0].d3[j] + w1 * p[1].d3[j] + w2 * p[2].d3[j];
  }
  return out;
}

PathSampler::PathSampler(const Joints& joints, const JointMap& map, const JointRates& rates)
    : joints_(joints), map_(map), rates_(rates) {
  for (size_t i = 0; i < joints.size(); ++i) {
    lowest_[i] = joints[i].limit.min;
    highest_[i] = joints[i].limit.max;
  }
}

void PathSampler::begin(const PlanPiece& first) {
  JointVec q;
  const bool stands = map_.map(first.piece.at(0), first.context, q) == KinStatus::kOk;
  for (size_t i = 0; i < static_cast<size_t>(rates_.count); ++i) {
    const JointLimit& limit = joints_[i].limit;
    const double at = stands ? q[static_cast<Eigen::Index>(i)] : limit.min;
    lowest_[i] = std::min(limit.min, at);
    highest_[i] = std::max(limit.max, at);
  }
}

void PathSampler::curve(const PlanPiece& piece, JointCurve& out) const {
  out.clear();
  add_panels(piece, 0, piece.piece.length, kPanelHalvingsMax, out);
}

void PathSampler::add_panels(const PlanPiece& piece, double s0, double s1, int halvings,
                             JointCurve& curve) const {
  JointPanel& panel = curve.emplace_back();
  const bool found = panel.interpolate(map_, piece, s0, s1);
  if (found && is_accurate(piece, panel)) return;
  const bool shorter = halvings > 0 && found && !panel.rounding();
  curve.pop_back();
  if (!shorter) return;  // rounding, or a kink of the map: there the map itself is asked for every sample
  const double middle = (s0 + s1) / 2;
  add_panels(piece, s0, middle, halvings - 1, curve);
  add_panels(piece, middle, s1, halvings - 1, curve);
}

// The panel's error counts with the greatest speed that the panel allows: times b in the acceleration (P5),
// times b^1.5 in the jerk (P6). It must be small against the joints' limits.
bool PathSampler::is_accurate(const PlanPiece& piece, const JointPanel& panel) const {
  double b = 0;
  for (const double s : {panel.s0(), (panel.s0() + panel.s1()) / 2, panel.s1()}) {
    JointDerivatives d;
    panel.at(s, d);
    b = std::max(b, bound({s, speed_bound(piece, d, s), d.d1, d.d2, d.d3}).b);
  }
  b *= kBoundMargin;
  for (size_t i = 0; i < static_cast<size_t>(rates_.count); ++i) {
    if (!(b * panel.error2()[i] <= kCurveAccuracy * rates_.acceleration[i])) return false;
    if (!(b * std::sqrt(b) * panel.error3()[i] <= kCurveAccuracy * rates_.jerk[i])) return false;
  }
  return true;
}

// The joint's greatest (side 1) or least (side -1) position near the sample, by the map itself: the
// polynomial of a panel, and the parabola at a turn, are some nanometres off, which counts where a joint just
// touches its limit.
double PathSampler::farthest(const PlanPiece& piece, size_t joint, double s_piece, double reach,
                             double side) const {
  double s = s_piece, most = side * map_derivatives(piece, s).q[joint];
  for (int i = 0; i < kTurnSteps; ++i) {
    const JointDerivatives d = map_derivatives(piece, s);
    if (!(d.d2[joint] * side < 0)) break;  // it does not turn back
    s = std::clamp(s - d.d1[joint] / d.d2[joint], std::max(0.0, s_piece - reach),
                   std::min(piece.piece.length, s_piece + reach));
    most = std::max(most, side * map_derivatives(piece, s).q[joint]);
  }
  return side * most;
}

void PathSampler::check_position(const PlanPiece& piece, const JointDerivatives& d, double s_piece,
                                 double reach) const {
  for (size_t i = 0; i < static_cast<size_t>(rates_.count); ++i) {
    double low = d.q[i], high = d.q[i];
    if (std::abs(d.d1[i]) < reach * std::abs(d.d2[i])) {  // the joint turns back before the next sample
      const double q_turn = d.q[i] - d.d1[i] * d.d1[i] / d.d2[i] / 2;
      low = std::min(low, q_turn);
      high = std::max(high, q_turn);
    }
    if (high > highest_[i]) high = farthest(piece, i, s_piece, reach, 1);
    if (low < lowest_[i]) low = farthest(piece, i, s_piece, reach, -1);
    if (high > highest_[i] + kRounding) fail_position(piece, joints_[i], high);
    if (low < lowest_[i] - kRounding) fail_position(piece, joints_[i], low);
  }
}

double PathSampler::speed_bound(const PlanPiece& piece, const JointDerivatives& d, double s_piece) const {
  double speed = feed_speed(piece, s_piece);
  if (!(speed > 0))
    throw ProgramError(fmt::format("line {}: the feed is zero; give a positive F word", piece.source.line));
  double share = 1 / speed;
  for (size_t i = 0; i < static_cast<size_t>(rates_.count); ++i)
    share = std::max(share, std::abs(d.d1[i]) * rates_.velocity_inverse[i]);
  speed = share > kTinyShare ? 1 / share : kNothingBinds;
  return speed * speed;
}

// From the joint map itself, where there is no panel: five evaluations a sample.
JointDerivatives PathSampler::map_derivatives(const PlanPiece& piece, double s_piece) const {
  JointDerivatives d;
  const KinStatus status = joint_derivatives(map_, piece, s_piece, d);
  if (status != KinStatus::kOk) {
    const Words y = piece.piece.at(s_piece);
    throw ProgramError(
        fmt::format("line {}: the machine cannot reach X{:.4f} Y{:.4f} Z{:.4f} A{:.4f} B{:.4f} C{:.4f}: {}",
                    piece.source.line, y[kX], y[kY], y[kZ], y[kA] * kDegPerRad, y[kB] * kDegPerRad,
                    y[kC] * kDegPerRad, to_string(status)));
  }
  return d;
}

PathSample PathSampler::sample(const PlanPiece& piece, const JointCurve& curve, double s_piece, double s,
                               double reach) const {
  JointDerivatives d;
  if (const JointPanel* panel = panel_at(curve, s_piece))
    panel->at(s_piece, d);
  else
    d = map_derivatives(piece, s_piece);
  check_position(piece, d, s_piece, reach);
  PathSample out{s, speed_bound(piece, d, s_piece), d.d1, d.d2, d.d3};
  if (std::isfinite(piece.feed.tip_mm_s2)) scale_to_tip_acceleration(piece, s_piece, out);
  return out;
}

bool PathSampler::parabolas_predict(const PlanPiece& piece, const JointCurve& curve, double s0, double s1,
                                    double step, double b, double share) const {
  const JointPanel* const panel = panel_at(curve, (s0 + s1) / 2);
  if (panel == nullptr || s0 < panel->s0() || s1 > panel->s1() || std::isfinite(piece.feed.tip_mm_s2))
    return false;
  // Lagrange's remainder halfway between two of the samples: the third derivative of what is interpolated,
  // over 6, times the distances step / 2, step / 2 and 3 step / 2. That of q'' is q's fifth, that of q''' its
  // sixth.
  const double off = b * step * step * step / 16, off3 = off * std::sqrt(b);
  for (size_t i = 0; i < static_cast<size_t>(rates_.count); ++i)
    if (off * panel->d5_max()[i] > share * rates_.acceleration[i] ||
        off3 * panel->d6_max()[i] > share * rates_.jerk[i])
      return false;
  return true;
}

// Where the program asks for less acceleration of the tip than the joints have, the sample's derivatives are
// scaled up. The joints then count as so much weaker, in jerk too, and the solver needs no other rows.
void PathSampler::scale_to_tip_acceleration(const PlanPiece& piece, double s_piece, PathSample& out) const {
  const double tip = piece.piece.derivatives(s_piece).d1.head<3>().norm();
  const double weaker = bound(out).acceleration * tip / piece.feed.tip_mm_s2;
  if (!(weaker > 1)) return;
  for (PerJoint* d : {&out.d1, &out.d2, &out.d3})
    for (double& value : *d) value *= weaker;
}

// At constant speed a and a' vanish in P5 and P6: b is the least of P4, A / |q''| and (J / |q'''|)^(2/3) over
// the joints. At rest b vanishes, and q' alone bounds acceleration and jerk of s, by A / |q'| and J / |q'|.
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

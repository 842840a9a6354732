#include "app/check/programmed_leg.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/check.h"
#include "core/units.h"

namespace trn {

namespace {

constexpr double kArcPieceRad = kPi / 8;  // the distance to so short an arc has one minimum inside
constexpr double kTurnPieceRad = 0.1;
constexpr double kTurnPiecesMax = 256;
constexpr double kWayOfChord = 1.05;
constexpr int kStepsMax = 64;
constexpr double kStepMin = 0.1;  // of the angle that is asked for
constexpr int kNewtonSteps = 60;
constexpr double kNoWayMm = 1e-11;
constexpr int kGoldenSteps = 50;
constexpr int kBisections = 30;

}  // namespace

double angle_deg(const Vec3& a, const Vec3& b) {
  // Half angles of two unit vectors: exact for small angles and for those near 180 degrees alike.
  return deg_from_rad(2 * std::atan2((a - b).norm(), (a + b).norm()));
}

ProgrammedLeg::ProgrammedLeg(const ProgramMove& move, const Kinematics& kinematics)
    : kinematics_(&kinematics) {
  start_ = move.from.head<3>();
  end_ = move.to.head<3>();
  along_ = end_ - start_;
  radial_.setZero();
  sideways_.setZero();
  arc_ = move.kind == ProgramMove::Kind::kArc;
  if (arc_) {
    const Vec3& axis = move.arc_axis;
    const Vec3 from_centre = start_ - move.arc_centre;
    radial_ = from_centre - axis * axis.dot(from_centre);
    sideways_ = axis.cross(radial_);
    sweep_rad_ = move.arc_sweep_rad;
    start_ -= radial_;
    // Along the axis, and the drift that closes an arc of rounded numbers at its programmed end.
    along_ = end_ - start_ - (std::cos(sweep_rad_) * radial_ + std::sin(sweep_rad_) * sideways_);
  }
  tip_length_mm_ = std::hypot(along_.norm(), radial_.norm() * sweep_rad_);
  abc_ = move.from.tail<3>();
  turn_ = move.to.tail<3>() - abc_;
  turn_rad_ = turn_.norm();
  axis_at_start_ = kinematics.orientation(abc_).col(2);
  // The axis turns no faster than all rotary words together, whatever the machine: the sum of their ways is a
  // bound.
  rate_deg_ = deg_from_rad(turn_.lpNorm<1>());
  if (turn_rad_ > 0) shares_at_once_ = std::min(1.0, kTurnPieceRad * kTurnPiecesMax / turn_.lpNorm<1>());
  const int pieces = turn_rad_ > 0 ? turn_pieces(1) : 0;
  Vec3 before = axis_at_start_;
  for (int i = 1; i <= pieces; ++i) {
    const Vec3 here = axis(static_cast<double>(i) / pieces);
    axis_way_deg_ += angle_deg(before, here);
    before = here;
  }
  // In the exact modes nothing may be cut off, and the tolerances stay 0.
  if (move.mode != PathMode::kContinuous) return;
  tolerance_mm_ = move.tolerance_mm;
  tolerance_deg_ = deg_from_rad(move.tolerance_rad);
}

Vec3 ProgrammedLeg::tip(double share) const {
  const Vec3 p = start_ + along_ * share;
  if (!arc_) return p;
  return p + std::cos(sweep_rad_ * share) * radial_ + std::sin(sweep_rad_ * share) * sideways_;
}

Vec3 ProgrammedLeg::tangent(double share) const {
  if (!arc_) return along_;
  const double angle = sweep_rad_ * share;
  return along_ + sweep_rad_ * (std::cos(angle) * sideways_ - std::sin(angle) * radial_);
}

Vec3 ProgrammedLeg::axis(double share) const {
  return turn_rad_ > 0 ? Vec3(kinematics_->orientation(abc_ + turn_ * share).col(2)) : axis_at_start_;
}

void ProgrammedLeg::nearest(const Vec3& p, double from, double to, std::vector<LegPlace>& out) const {
  const auto add = [&](double share) { out.push_back({share, (tip(share) - p).norm()}); };
  if (tip_length_mm_ <= 0) return add(from);
  if (!arc_) return add(std::clamp((p - start_).dot(along_) / along_.squaredNorm(), from, to));
  const int pieces =
      std::max(1, static_cast<int>(std::ceil(std::abs(sweep_rad_) * (to - from) / kArcPieceRad)));
  // A minimum lies where the distance stops falling. The ends of the stretch count as minima if the distance
  // rises from there on.
  bool falling = true;  // the distance, as the place comes in from before `from`
  double begin = from;
  for (int i = 1; i <= pieces; ++i) {
    const double end = from + (to - from) * i / pieces;
    const bool falling_begin = (tip(begin) - p).dot(tangent(begin)) < 0;
    const bool falling_end = (tip(end) - p).dot(tangent(end)) < 0;
    if (falling && !falling_begin) add(begin);
    if (falling_begin && !falling_end) add(arc_minimum(p, begin, end));
    falling = falling_end;
    begin = end;
  }
  if (falling) add(to);
}

// Where the tangent is square to the line to p; the sign of their product changes between the two shares.
double ProgrammedLeg::arc_minimum(const Vec3& p, double from, double to) const {
  double share = (from + to) / 2;
  for (int i = 0; i < kNewtonSteps; ++i) {
    const Vec3 away = tip(share) - p, t = tangent(share);
    const double slope = away.dot(t);
    (slope < 0 ? from : to) = share;
    // Newton's method on the slope of the squared distance, kept between two places where the slope has
    // opposite signs: where a step leaves them, the middle serves.
    const Vec3 curvature = sweep_rad_ * sweep_rad_ * (start_ + along_ * share - tip(share));
    const double second = t.squaredNorm() + away.dot(curvature);
    const double step = second > 0 ? -slope / second : 1;
    if (std::abs(step) * tip_length_mm_ <= kNoWayMm) return share;  // before rounding alone decides the sign
    const double next = share + step;
    share = next > from && next < to ? next : (from + to) / 2;
  }
  return share;
}

double ProgrammedLeg::reach_at_most(const Vec3& p, const LegPlace& place, double within_mm, int direction,
                                    double most) const {
  if (tip_length_mm_ <= 0) return most;
  if (place.distance_mm > within_mm) return 0;
  const double square = within_mm * within_mm - place.distance_mm * place.distance_mm;
  // Pythagoras: the distance to the line is one side, the way along it the other.
  double shares = std::sqrt(square) / tip_length_mm_;  // exact for a line, near for an arc
  if (!arc_) return std::min(shares, most);
  const auto fits = [&] { return (tip(place.share + direction * shares) - p).norm() <= within_mm; };
  while (shares < most && fits()) shares *= 1.5;
  return std::min(shares, most);
}

double ProgrammedLeg::reach(const Vec3& p, const LegPlace& place, double within_mm, int direction,
                            double most) const {
  double outside = reach_at_most(p, place, within_mm, direction, most);
  if (!arc_ || tip_length_mm_ <= 0) return outside;
  const auto fits = [&](double shares) {
    return (tip(place.share + direction * shares) - p).norm() <= within_mm;
  };
  if (outside >= most && fits(most)) return most;
  double inside = 0;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = (inside + outside) / 2;
    (fits(middle) ? inside : outside) = middle;
  }
  return inside;
}

int ProgrammedLeg::turn_pieces(double shares) const {
  const double pieces = std::ceil(turn_.lpNorm<1>() * shares / kTurnPieceRad);
  return static_cast<int>(std::clamp(pieces, 1.0, kTurnPiecesMax));
}

// The axis has one nearest place on so short a piece of its way, which is hardly longer than its chord: where
// both ends are farther away than the best place by half of it, that is not the one.
double ProgrammedLeg::smallest_angle_deg(const Vec3& u, double from, double to, double enough_deg) const {
  const int pieces = turn_pieces(to - from);
  TRN_CHECK(from <= to && pieces >= 1 && pieces <= static_cast<int>(kTurnPiecesMax));
  const double width = (to - from) / pieces;
  std::array<double, static_cast<std::size_t>(kTurnPiecesMax) + 1> angle{}, way{};
  Vec3 before = axis(from);
  double best = angle[0] = angle_deg(u, before);
  for (int i = 1; i <= pieces; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Vec3 here = axis(from + width * i);
    angle[k] = angle_deg(u, here);
    way[k] = kWayOfChord * angle_deg(before, here);
    best = std::min(best, angle[k]);
    before = here;
  }
  for (int i = 1; i <= pieces && best > enough_deg; ++i) {
    const auto k = static_cast<std::size_t>(i);
    // Between the ends of a piece the angle is at least the mean of both less half of the way: pieces that
    // cannot hold a better place are passed over.
    if ((angle[k - 1] + angle[k] - way[k]) / 2 >= best) continue;
    const double begin = from + width * (i - 1);
    best = std::min(best, refined_angle_deg(u, begin, begin + width, enough_deg));
  }
  return best;
}

// Steps that cannot pass over the first such place, as the angle changes no faster than the words turn.
double ProgrammedLeg::first_share_within(const Vec3& u, double from, double to, double within_deg) const {
  double share = from;
  for (int i = 0; i < kStepsMax && share < to; ++i) {
    const double over = angle_deg(u, axis(share)) - within_deg;
    if (over <= 0) return share;
    share += std::max(over, kStepMin * within_deg) / rate_deg_;
  }
  return std::min(share, to);
}

// Golden section between two shares with one minimum of the angle, down to rounding.
double ProgrammedLeg::refined_angle_deg(const Vec3& u, double from, double to, double enough_deg) const {
  constexpr double kGolden = 0.6180339887498949;
  double left = to - kGolden * (to - from), right = from + kGolden * (to - from);
  double at_left = angle_deg(u, axis(left)), at_right = angle_deg(u, axis(right));
  for (int i = 0; i < kGoldenSteps && std::min(at_left, at_right) > enough_deg; ++i) {
    // Each step keeps one of the two places inside, so that it costs one evaluation of the kinematics.
    if (at_left < at_right) {
      to = right;
      right = left;
      at_right = at_left;
      left = to - kGolden * (to - from);
      at_left = angle_deg(u, axis(left));
    } else {
      from = left;
      left = right;
      at_left = at_right;
      right = from + kGolden * (to - from);
      at_right = angle_deg(u, axis(right));
    }
  }
  return std::min(at_left, at_right);
}

}  // namespace trn

#include <fmt/format.h>

#include <cmath>

#include "core/check.h"
#include "core/frames.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/error.h"
#include "interp/gcode/executor.h"
#include "interp/gcode/executor/nurbs.h"
#include "interp/gcode/g_code.h"
#include "interp/gcode/modal.h"
#include "interp/gcode/text/block.h"

// Splines in the XY plane: G5 (cubic), G5.1 (quadratic), G5.2/G5.3 (NURBS); NURBS in space by G6.2.
namespace trn {

namespace {

Vec3 lift(double x, double y) { return {x, y, 0}; }

// Degree elevation: the quadratic with control point q as a cubic.
std::array<Vec3, 4> cubic_from_quadratic(const Vec3& a, const Vec3& q, const Vec3& d) {
  return {a, a + (q - a) * (2.0 / 3.0), d + (q - d) * (2.0 / 3.0), d};
}

}  // namespace

void Executor::spline(const Block& b, GCode motion) {
  const std::uint32_t column = b.at(GGroup::kMotion);
  if (motion == 5.1_g && b.has('Q') && !b.has_axis_word() && !b.has('I')) return ignore_smoothing(column);
  if (comp_.active()) fail(GcodeErrorCode::kCompState, column, g_name(motion));
  if (left_contour_)
    fail(GcodeErrorCode::kCompCorner, column, "the first move after G40 is a spline", "a straight move");
  if (s_.modal.plane != Plane::kXY)
    fail(GcodeErrorCode::kPlane, column, g_name(motion), s_.modal.plane == Plane::kXZ ? "G18" : "G19", "G17");
  if (motion != 5.3_g) check_feed(b, g_name(motion));
  for (const char letter : {'Z', 'A', 'B', 'C'})
    if (b.has(letter)) fail(GcodeErrorCode::kSpline, b.at(letter), "a spline stays in XY", "X and Y");
  if (motion == 5_g) return cubic_spline(b);
  if (motion == 5.1_g) return quadratic_spline(b);
  nurbs(b, motion);
}

void Executor::ignore_smoothing(std::uint32_t column) {
  if (!warned_smoothing_)
    parts_.warn(column, "G5.1 Q, the smoothing of other controls, is ignored; G64 P sets tolerances");
  warned_smoothing_ = true;
}

void Executor::cubic_spline(const Block& b) {
  const std::uint32_t column = b.at(GGroup::kMotion);
  if (!b.has('P') || !b.has('Q')) fail(GcodeErrorCode::kMissingWord, column, "G5", "P and Q words");
  if (b.has('I') != b.has('J')) fail(GcodeErrorCode::kMissingWord, column, "G5", "both I and J, or neither");
  const ProgramWords to = target(b);
  const bool chained = !b.has('I') && spline_chained_;  // without I and J a first G5 begins in a point
  // The tangent of the last piece at its end was P Q, seen from the end backwards. Turned round it leads on,
  // and the two pieces meet without a corner.
  const double i = chained ? -spline_tangent_[kX] : b.get('I', 0);
  const double j = chained ? -spline_tangent_[kY] : b.get('J', 0);
  auto hull = std::make_shared<std::vector<Vec3>>();
  *hull = {lift(s_.position[kX], s_.position[kY]), lift(s_.position[kX] + i, s_.position[kY] + j),
           lift(to[kX] + b['P'], to[kY] + b['Q']), lift(to[kX], to[kY])};
  put(canon::NurbsFeed{4, to, hull, false, inverse_rate(b)});
  spline_tangent_[kX] = b['P'];
  spline_tangent_[kY] = b['Q'];
  spline_chained_ = true;
  s_.position = to;
}

void Executor::quadratic_spline(const Block& b) {
  const std::uint32_t column = b.at(GGroup::kMotion);
  if (!b.has('I') || !b.has('J')) fail(GcodeErrorCode::kMissingWord, column, "G5.1", "I and J words");
  const ProgramWords to = target(b);
  const Vec3 from = lift(s_.position[kX], s_.position[kY]), end = lift(to[kX], to[kY]);
  const auto cubic = cubic_from_quadratic(from, from + lift(b['I'], b['J']), end);
  auto hull = std::make_shared<std::vector<Vec3>>(cubic.begin(), cubic.end());
  put(canon::NurbsFeed{3, to, hull, false, inverse_rate(b)});
  s_.position = to;
}

void Executor::control_point(const Block& b) {
  if (!b.has_axis_word()) return;
  const std::uint32_t column = b.motion_column();
  if (!b.has('X') || !b.has('Y'))
    fail(GcodeErrorCode::kMissingWord, column, "a control point of G5.2", "both X and Y");
  if (!b.has('P')) fail(GcodeErrorCode::kMissingWord, column, "a control point of G5.2", "a weight P");
  if (b['P'] <= 0) fail(GcodeErrorCode::kBadValue, b.at('P'), 'P', b['P'], "G5.2", "a weight above 0");
  const ProgramWords to = target(b);
  nurbs_.push_back({to[kX], to[kY], b['P']});
}

// G5.2 collects control points (X Y, weight P, order L), G5.3 runs the curve: as cubic pieces through points
// and tangents of the curve, fine enough to stay within a micrometre.
void Executor::nurbs(const Block& b, GCode motion) {
  const std::uint32_t column = b.at(GGroup::kMotion);
  if (motion == 5.2_g) {
    // The place where the tool stands is the first control point.
    if (!in_nurbs_) {
      nurbs_.assign(1, {s_.position[kX], s_.position[kY], b.get('P', 1)});
      nurbs_order_ = b.get('L', 3);
      curve_rate_ = inverse_rate(b);
      in_nurbs_ = true;
    }
    return control_point(b);
  }
  if (!in_nurbs_) fail(GcodeErrorCode::kSpline, column, "G5.3 without G5.2", "G5.2 first");
  in_nurbs_ = false;
  const int order = static_cast<int>(nurbs_order_);
  if (order < 2 || order != nurbs_order_ || nurbs_.size() < static_cast<std::size_t>(std::max(3, order)))
    fail(GcodeErrorCode::kSpline, column, "G5.2 has too few control points for its order L",
         "at least as many control points as the order");
  NurbsCurve curve{order, clamped_uniform_knots(nurbs_.size(), order), {}};
  for (const NurbsPoint& p : nurbs_) curve.points.emplace_back(p.x, p.y, 0, p.weight);
  auto hull = std::make_shared<std::vector<Vec3>>(cubic_hulls(curve));
  ProgramWords to = s_.position;
  TRN_CHECK(!nurbs_.empty() && !hull->empty());
  to[kX] = nurbs_.back().x;
  to[kY] = nurbs_.back().y;
  put(canon::NurbsFeed{static_cast<int>(nurbs_.size()), to, hull, false, curve_rate_});
  s_.position = to;
}

// G6.2 (other controls' NURBS): the first line has the order P, each line a knot K and a control point with
// its weight R, the first of them where the tool stands; as many lines as the order have a knot only.
void Executor::rational_spline(const Block& b) {
  const std::uint32_t column = b.motion_column();
  if (!b.has('K')) fail(GcodeErrorCode::kMissingWord, column, "G6.2", "a K word, the knot");
  if (comp_.active()) fail(GcodeErrorCode::kCompState, column, "G6.2");
  if (b.code(GGroup::kMotion) == 6.2_g && !in_rational_) {
    check_feed(b, "G6.2");
    rational_ = {};
    curve_rate_ = inverse_rate(b);
    const double order = b.get('P', 4);
    if (order != std::round(order) || order < 2 || order > 8)
      fail(GcodeErrorCode::kBadValue, b.at('P'), 'P', order, "G6.2", "an order from 2 to 8");
    rational_.order = static_cast<int>(order);
    in_rational_ = true;
  }
  if (!in_rational_)
    fail(GcodeErrorCode::kSpline, column, "a curve ends before this line", "G6.2 P K X Y Z first");
  if (!rational_.knots.empty() && b['K'] < rational_.knots.back())
    fail(GcodeErrorCode::kBadValue, b.at('K'), 'K', b['K'], "G6.2", "knots that do not fall");
  // A line with a knot only has been there: from then on there are more knots than points, and no further
  // point may come.
  const bool tail = rational_.knots.size() > rational_.points.size();
  rational_.knots.push_back(b['K']);
  if (b.has_axis_word()) return rational_point(b, tail, column);
  // A curve has as many knots as control points and order together (m = n + p + 1 in Piegl and Tiller, The
  // NURBS Book, all of them counted from 0).
  const std::size_t needed = rational_.points.size() + static_cast<std::size_t>(rational_.order);
  if (rational_.knots.size() == needed) finish_rational(column);
}

void Executor::rational_point(const Block& b, bool tail, std::uint32_t column) {
  for (const char letter : {'A', 'B', 'C'})
    if (b.has(letter)) fail(GcodeErrorCode::kSpline, b.at(letter), "G6.2 turns no rotary axis", "X, Y and Z");
  if (tail)
    fail(GcodeErrorCode::kSpline, column, "a control point behind a line with a knot only", "knots only");
  const double weight = b.get('R', 1);
  if (weight <= 0) fail(GcodeErrorCode::kBadValue, b.at('R'), 'R', weight, "G6.2", "a weight above 0");
  ProgramWords point = target(b);
  if (rational_.points.empty() && (point - s_.position).xyz.norm() > from_mm(parts_.config.arc_tolerance_mm))
    fail(GcodeErrorCode::kSpline, column, "the first control point of G6.2 is not where the tool stands",
         "a move to it first");
  if (!rational_.points.empty() && !s_.modal.incremental) {  // words that are missing: as in the point before
    for (int i = 0; i < 3; ++i)
      if (!b.has(kWordLetters[i])) point[i] = rational_.points.back()[i];
  }
  rational_.points.emplace_back(point[kX], point[kY], point[kZ], weight);
}

void Executor::finish_rational(std::uint32_t column) {
  in_rational_ = false;
  if (rational_.points.size() < static_cast<std::size_t>(rational_.order) ||
      rational_.first() >= rational_.last())
    fail(GcodeErrorCode::kSpline, column, "G6.2 has too few control points for its order P",
         "at least as many control points as the order, and knots that rise");
  auto hull = std::make_shared<std::vector<Vec3>>(cubic_hulls(rational_));
  ProgramWords to = s_.position;
  TRN_CHECK(!hull->empty());
  to.xyz = hull->back();
  put(canon::NurbsFeed{static_cast<int>(rational_.points.size()), to, hull, true, curve_rate_});
  s_.position = to;
}

}  // namespace trn

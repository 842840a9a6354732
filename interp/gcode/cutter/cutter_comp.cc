#include "interp/gcode/cutter/cutter_comp.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/check.h"
#include "core/units.h"
#include "interp/gcode/cutter/plane_curve.h"
#include "interp/gcode/error.h"

namespace trn {

namespace {

using Point = Eigen::Vector2d;

constexpr double kTiny = 1e-9;
// The controlled point of a lathe's tool for its orientations 0 to 9: from the centre of the nose, in Z and
// X, in nose radii.
const Point kControlledPoint[] = {{0, 0}, {1, -1}, {-1, -1}, {-1, 1}, {1, 1},
                                  {1, 0}, {0, -1}, {-1, 0},  {0, 1},  {0, 0}};
constexpr double kReversal_rad = 1e-6;
constexpr double kSweepMore_rad = 1;    // a corner that counts as none may lengthen an arc, by less than this
constexpr double kStraight_rad = 0.05;  // corners flatter than this are no corners (the dialect's own bound)

Point turned_left(const Point& t) { return {-t.y(), t.x()}; }

// Where a line (point, unit direction) and a circle meet, nearest to `near`; false if they do not.
bool line_circle(const Point& p, const Point& d, const Point& centre, double radius, const Point& near,
                 Point& out) {
  const double along = d.dot(centre - p);
  const double gap2 = (p + along * d - centre).squaredNorm();
  const double half2 = radius * radius - gap2;
  // A line that just touches its circle misses it by rounding. A billionth of the radius squared counts as
  // touching.
  if (half2 < -1e-9 * radius * radius) return false;
  const double half = std::sqrt(std::max(0.0, half2));
  const Point one = p + (along - half) * d, two = p + (along + half) * d;
  out = (one - near).norm() < (two - near).norm() ? one : two;
  return true;
}

bool circle_circle(const Point& c1, double r1, const Point& c2, double r2, const Point& near, Point& out) {
  const Point d = c2 - c1;
  const double distance = d.norm();
  if (distance < kTiny) return false;
  const double along = (r1 * r1 - r2 * r2 + distance * distance) / (2 * distance);
  const double half2 = r1 * r1 - along * along;
  if (half2 < -1e-9 * r1 * r1) return false;
  const double half = std::sqrt(std::max(0.0, half2));
  const Point u = d / distance, foot = c1 + along * u;
  const Point one = foot + half * turned_left(u), two = foot - half * turned_left(u);
  out = (one - near).norm() < (two - near).norm() ? one : two;
  return true;
}

bool is_motion(const CanonCommand& command) {
  return std::holds_alternative<canon::StraightTraverse>(command) ||
         std::holds_alternative<canon::StraightFeed>(command) ||
         std::holds_alternative<canon::ArcFeed>(command);
}

// An arc as the first move: it ends beside the programmed end, on a circle through the start whose centre
// lies on the same spoke, so that it leaves tangent to the contour.
template <typename Element, typename Point2>
void bend_entry(Element& e, const Point2& beside_end, double tool_radius) {
  const Point spoke = e.to - e.centre;
  const double size = spoke.norm();
  const Point u = spoke / size, d = beside_end - e.from;
  // A circle through the start and the offset end has its centre on the spoke where both are as far away: |d
  // - r u| = r gives r = d^2 / (2 d.u).
  const double radius = d.squaredNorm() / (2 * d.dot(u));
  if (size < tool_radius - kTiny || !(radius > kTiny) || !std::isfinite(radius))
    fail(GcodeErrorCode::kCompCorner, 1,
         fmt::format("the entry arc of radius {:.4f} is smaller than the tool's {:.4f}", size, tool_radius),
         "a larger arc, or a straight move longer than the tool's radius");
  e.centre = beside_end - radius * u;
  auto& arc = std::get<canon::ArcFeed>(e.command);
  arc.centre1 = e.centre.x();
  arc.centre2 = e.centre.y();
}

ProgramWords& target_of(CanonCommand& command) {
  if (auto* traverse = std::get_if<canon::StraightTraverse>(&command)) return traverse->to;
  if (auto* feed = std::get_if<canon::StraightFeed>(&command)) return feed->to;
  return std::get<canon::ArcFeed>(command).to;
}
const ProgramWords& target_of(const CanonCommand& command) {
  return target_of(const_cast<CanonCommand&>(command));
}

}  // namespace

void CutterComp::start(bool left, double radius, Plane plane, const ProgramWords& from, double rounding,
                       int orientation) {
  TRN_CHECK(orientation >= 0 && orientation <= 9);
  active_ = true;
  left_ = left;
  radius_ = radius;
  shift_ = radius * kControlledPoint[static_cast<std::size_t>(orientation)];
  plane_ = plane;
  first_ = plane == Plane::kXZ ? kZ : kX;
  second_ = plane == Plane::kXZ ? kX : kY;
  normal_ = plane == Plane::kXZ ? kY : kZ;
  programmed_ = tool_ = from;
  entered_ = given_up_ = false;
  waiting_.clear();
  check_.begin(radius, left, rounding);
  contour_ends_ = false;
}

ProgramWords CutterComp::place(const Point& p, const ProgramWords& like) const {
  ProgramWords v = like;
  v[first_] = p.x() + shift_.x();
  v[second_] = p.y() + shift_.y();
  return v;
}

CutterComp::Point CutterComp::side_normal(const Point& t) const {
  return left_ ? turned_left(t) : Point(-turned_left(t));
}

CutterComp::Point CutterComp::tangent(const Element& e, bool at_end) const {
  TRN_CHECK(e.shape == Shape::kLine || e.shape == Shape::kArc);
  if (e.shape == Shape::kLine) return (e.to - e.from).normalized();
  const Point spoke = ((at_end ? e.to : e.from) - e.centre).normalized();
  return e.turn * turned_left(spoke);
}

CutterComp::Element CutterComp::make_element(const CanonCommand& command, const BlockPlace& at) const {
  TRN_CHECK(active_ && is_motion(command));
  Element e;
  e.command = command;
  e.place = at;
  e.from = plane_point(programmed_);
  e.to = plane_point(target_of(command));
  e.from_height = programmed_[normal_];
  e.to_height = target_of(command)[normal_];
  if (const auto* arc = std::get_if<canon::ArcFeed>(&command)) {
    e.shape = Shape::kArc;
    e.centre = {arc->centre1, arc->centre2};
    e.turn = arc->turns > 0 ? 1 : -1;
  } else {
    // A move along the tool's axis, or of rotary axes alone, has no direction in the plane and so no side.
    e.shape = (e.to - e.from).norm() < kTiny ? Shape::kVertical : Shape::kLine;
  }
  return e;
}

// The tool's centre beside the whole element, before corners.
void CutterComp::offset(Element& e) const {
  e.b = e.to + radius_ * side_normal(tangent(e, true));
  e.a = e.entry ? e.from : Point(e.from + radius_ * side_normal(tangent(e, false)));
  if (e.shape != Shape::kArc) return;
  if (e.entry) {
    e.radius = (e.b - e.centre).norm();
    return;
  }
  // G41 on a counterclockwise arc runs inside it, and the tool's centre on a smaller circle. If the tool does
  // not fit in, no path is beside that arc.
  const bool inside = (e.turn > 0) == left_;
  const double size = (e.from - e.centre).norm();
  e.radius = inside ? size - radius_ : size + radius_;
  if (e.radius <= kTiny * size)
    fail(GcodeErrorCode::kCompCorner, 1,
         fmt::format("the tool of radius {:.4f} does not fit the arc of radius {:.4f}", radius_, size),
         "a smaller tool");
}

// Where the offset curves of two neighbours meet, near their corner.
CutterComp::Point CutterComp::meet(const Element& before, const Element& after, const Point& near) const {
  Point out;
  bool found = false;
  if (before.shape == Shape::kLine && after.shape == Shape::kLine) {
    const Point t1 = tangent(before, true), t2 = tangent(after, false);
    const double c = cross(t1, t2);
    found = std::fabs(c) > kTiny;
    if (found) out = before.b + t1 * (cross(after.a - before.b, t2) / c);
  } else if (before.shape == Shape::kLine) {
    found = line_circle(before.b, tangent(before, true), after.centre, after.radius, near, out);
  } else if (after.shape == Shape::kLine) {
    found = line_circle(after.a, tangent(after, false), before.centre, before.radius, near, out);
  } else {
    found = circle_circle(before.centre, before.radius, after.centre, after.radius, near, out);
  }
  if (!found) gouge(after, before.place.line);
  return out;
}

// What happens between two elements. `turn` is the angle between their directions. A corner flatter than
// kStraight_rad is none: the tool goes on from where it is. Outside a corner the tool goes round it on an arc
// about the corner point; inside, both elements end where their offset curves meet (RS274/NGC appendix B).
void CutterComp::corner(Element& before, Element& after) const {
  const Point t1 = tangent(before, true), t2 = tangent(after, false);
  // Positive to the left. G41 at an inside corner of 30 degrees: the contour turns left by 150 degrees,
  // towards the tool, and the tool stops short of the corner on both sides.
  const double turn = std::atan2(cross(t1, t2), t1.dot(t2));
  const bool reversal = std::fabs(turn) > kPi - kReversal_rad;
  // Where the contour turns back into itself, curvature says on which side of it the tool is.
  const double bend = reversal ? -curvature(before) - curvature(after) : turn;
  const double towards_tool = left_ ? bend : -bend;
  if (std::fabs(turn) < kStraight_rad) {
    after.a = before.b;
    before.bend_rad = std::max(before.bend_rad, std::fabs(turn));
    after.bend_rad = std::fabs(turn);
    // Away from the tool: the tool's edge must stay on the corner point, so its centre goes round it by the
    // radius.
  } else if (towards_tool <= 0) {
    before.rounded = true;
    before.round_to = after.a;
  } else {
    before.b = after.a = meet(before, after, reversal ? Point(before.to - radius_ * t1) : before.to);
  }
}

// Signed, positive to the left.
double CutterComp::curvature(const Element& e) {
  return e.shape == Shape::kArc ? e.turn / (e.to - e.centre).norm() : 0.0;
}

void CutterComp::gouge(const Element& e, std::uint32_t other_line) const {
  fail(GcodeErrorCode::kCompGouge, 1, radius_, e.place.line, other_line);
}

// An inside corner shortens an arc. Where it takes more than there is, the ends have passed each other and
// the arc would go nearly a full turn round: the tool has no path beside it.
void CutterComp::check_arc(const Element& e, std::uint32_t other_line) const {
  TRN_CHECK(e.shape != Shape::kArc || e.turn == 1 || e.turn == -1);
  if (e.shape != Shape::kArc || e.entry) return;
  const double programmed = sweep_of(e.centre, e.from, e.to, e.turn);
  const double left = sweep_of(e.centre, e.a, e.b, e.turn);
  if (left > programmed + kSweepMore_rad) gouge(e, other_line);
}

// Hands `e`, whose end and corner are known now, to the gouge check. A rapid is no contour and ends one.
// Where a corner counted as none, or an arc does not quite meet its end, the path may be off by that much,
// and this is no gouge.
void CutterComp::judge(const Element& e) {
  if (!judges_) return;
  const bool rapid = std::holds_alternative<canon::StraightTraverse>(e.command);
  const double gap =
      e.shape == Shape::kArc ? std::fabs((e.from - e.centre).norm() - (e.to - e.centre).norm()) : 0;
  const int turn = e.shape == Shape::kArc ? e.turn : 0;
  GougeCheck::Move move;
  move.contour = {e.from, e.to, e.centre, turn};
  move.path = {e.a, e.b, e.centre, turn};
  if (e.rounded) move.corner = PlaneCurve{e.b, e.round_to, e.to, left_ ? -1 : 1};
  move.from_height = e.from_height;
  move.to_height = e.to_height;
  move.path_slack = radius_ * e.bend_rad * e.bend_rad + 2 * gap;
  move.wall_slack = 2 * gap;
  move.place = e.place;
  if (e.entry && !rapid)
    check_.enter(move);
  else if (!e.entry && !rapid)
    check_.add(move);
  if (contour_ends_ || rapid) check_.end();
  contour_ends_ = false;
}

void CutterComp::entry_too_short(double length) const {
  if (radius_ == 0) return;
  fail(GcodeErrorCode::kCompCorner, 1,
       fmt::format("the entry move is {:.4f} long, the tool's radius {:.4f}", length, radius_),
       "a straight move longer than the tool's radius");
}

void CutterComp::move(const CanonCommand& command, const BlockPlace& at, CanonSink& sink) {
  if (radius_ == 0 || given_up_) {  // the path is the programmed one: nothing to wait for
    programmed_ = tool_ = target_of(command);
    entered_ = true;
    return sink.put(command, at.line);
  }
  Element e = make_element(command, at);
  if (e.shape == Shape::kVertical && !entered_) entry_too_short(0);
  // It goes where the tool is in the plane, which is known once the move before it has its end.
  if (e.shape == Shape::kVertical) {
    programmed_ = target_of(command);
    waiting_.push_back(std::move(e));
    contour_ends_ = true;
    if (!entered_) release(sink);
    return;
  }
  // The entry brings the tool to the side of the contour: from the programmed place to a place square beside
  // the end. A way shorter than the radius would bring it back through the corner.
  if (!entered_) {
    if (e.shape == Shape::kArc)
      bend_entry(e, Point(e.to + radius_ * side_normal(tangent(e, true))), radius_);
    else if ((e.to - e.from).norm() <= radius_)
      entry_too_short((e.to - e.from).norm());
    e.entry = true;
    entered_ = true;
  }
  offset(e);
  // With this element the corner behind the one before is known, and that one can go.
  if (!waiting_.empty()) {
    Element& before = waiting_.front();
    corner(before, e);
    check_arc(before, at.line);
    const bool straight = before.rounded && std::holds_alternative<canon::StraightTraverse>(command);
    const Point round_to = before.round_to;
    if (straight) before.rounded = false;
    judge(before);
    release(sink);
    if (straight) {  // a rapid does not follow the corner
      tool_ = place(round_to, tool_);
      sink.put(canon::StraightTraverse{tool_}, at.line);
    }
  }
  programmed_ = target_of(command);
  waiting_.push_back(std::move(e));
}

void CutterComp::pass(const CanonCommand& command, std::uint32_t line, CanonSink& sink) {
  TRN_CHECK(!is_motion(command));
  if (waiting_.empty()) return sink.put(command, line);
  Element e;
  e.command = command;
  e.place.line = line;
  // The text must outlive the call.
  if (const auto* comment = std::get_if<canon::Comment>(&command)) e.text = std::string(comment->text);
  waiting_.push_back(std::move(e));
}

void CutterComp::release(CanonSink& sink) {
  if (waiting_.empty()) return;
  const bool rounded = waiting_.front().rounded;
  const Point about = waiting_.front().to, round_to = waiting_.front().round_to;
  const std::uint32_t line = waiting_.front().place.line;
  // In the order of the program: M codes and comments between two moves come when the first has come to its
  // end.
  for (; !waiting_.empty(); waiting_.pop_front()) emit(waiting_.front(), sink);
  if (!rounded) return;  // what stood between the two moves happens before the corner
  tool_ = place(round_to, tool_);
  sink.put(canon::ArcFeed{tool_, about.x() + shift_.x(), about.y() + shift_.y(), left_ ? -1 : 1, plane_, 0},
           line);
}

void CutterComp::emit(const Element& e, CanonSink& sink) {
  CanonCommand command = e.command;
  if (e.shape == Shape::kOther) {
    if (auto* comment = std::get_if<canon::Comment>(&command)) comment->text = e.text;
    return sink.put(command, e.place.line);
  }
  ProgramWords& to = target_of(command);
  to = place(e.shape == Shape::kVertical ? Point(plane_point(tool_) - shift_) : e.b, to);
  if (auto* arc = std::get_if<canon::ArcFeed>(&command)) {
    arc->centre1 += shift_.x();
    arc->centre2 += shift_.y();
  }
  tool_ = to;
  sink.put(command, e.place.line);
}

ProgramWords CutterComp::finish(CanonSink& sink) {
  TRN_CHECK(active_);
  if (!waiting_.empty() && is_motion(waiting_.front().command) &&
      waiting_.front().shape != Shape::kVertical) {
    check_arc(waiting_.front(), waiting_.front().place.line);
    judge(waiting_.front());
    check_.end();
  }
  release(sink);
  TRN_CHECK(waiting_.empty());
  active_ = false;
  return entered_ ? tool_ : programmed_;
}

void CutterComp::give_up() {
  given_up_ = true;
  waiting_.clear();
}

}  // namespace trn

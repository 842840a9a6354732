#include "interp/gcode/cutter_comp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/units.h"
#include "interp/gcode/error.h"

namespace trn {

namespace {

using Point = Eigen::Vector2d;

constexpr double kTiny = 1e-9;
constexpr double kStraight_rad = 0.05;  // corners flatter than this are no corners (the dialect's own bound)
constexpr double kTouch = 1e-3;         // of the radius: closer than the tool by this much is a gouge
constexpr int kArcSamples = 16;

double cross(const Point& a, const Point& b) { return a.x() * b.y() - a.y() * b.x(); }
Point turned_left(const Point& t) { return {-t.y(), t.x()}; }

double sweep_of(const Point& centre, const Point& from, const Point& to, int turn) {
  const Point a = from - centre, b = to - centre;
  double angle = turn * std::atan2(cross(a, b), a.dot(b));
  if (angle <= kTiny) angle += 2 * kPi;
  return angle;
}

// Where a line (point, unit direction) and a circle meet, nearest to `near`; false if they do not.
bool line_circle(const Point& p, const Point& d, const Point& centre, double radius, const Point& near,
                 Point& out) {
  const double along = d.dot(centre - p);
  const double gap2 = (p + along * d - centre).squaredNorm();
  const double half2 = radius * radius - gap2;
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

double point_segment(const Point& p, const Point& a, const Point& b) {
  const Point d = b - a;
  const double length2 = d.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(d) / length2, 0.0, 1.0) : 0;
  return (p - a - t * d).norm();
}

bool segments_cross(const Point& a, const Point& b, const Point& c, const Point& d) {
  const double s1 = cross(b - a, c - a), s2 = cross(b - a, d - a), s3 = cross(d - c, a - c),
               s4 = cross(d - c, b - c);
  return s1 * s2 < 0 && s3 * s4 < 0;
}

// Least distance of two chains of points.
double chain_distance(const std::vector<Point>& one, const std::vector<Point>& two) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < one.size(); ++i)
    for (std::size_t k = 0; k + 1 < two.size(); ++k) {
      if (segments_cross(one[i], one[i + 1], two[k], two[k + 1])) return 0;
      least = std::min(
          {least, point_segment(one[i], two[k], two[k + 1]), point_segment(one[i + 1], two[k], two[k + 1]),
           point_segment(two[k], one[i], one[i + 1]), point_segment(two[k + 1], one[i], one[i + 1])});
    }
  return least;
}

std::vector<Point> chain(bool is_arc, const Point& from, const Point& to, const Point& centre, int turn) {
  if (!is_arc) return {from, to};
  std::vector<Point> points;
  const double sweep = turn * sweep_of(centre, from, to, turn);
  for (int i = 0; i <= kArcSamples; ++i)
    points.push_back(centre + Eigen::Rotation2Dd(sweep * i / kArcSamples) * (from - centre));
  return points;
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

AxisValues& target_of(CanonCommand& command) {
  if (auto* traverse = std::get_if<canon::StraightTraverse>(&command)) return traverse->to;
  if (auto* feed = std::get_if<canon::StraightFeed>(&command)) return feed->to;
  return std::get<canon::ArcFeed>(command).to;
}
const AxisValues& target_of(const CanonCommand& command) {
  return target_of(const_cast<CanonCommand&>(command));
}

}  // namespace

void CutterComp::start(bool left, double radius, Plane plane, const AxisValues& from) {
  active_ = true;
  left_ = left;
  radius_ = radius;
  plane_ = plane;
  first_ = plane == Plane::kXZ ? kZ : kX;
  second_ = plane == Plane::kXZ ? kX : kY;
  programmed_ = tool_ = from;
  entered_ = false;
  waiting_.clear();
  done_.clear();
}

AxisValues CutterComp::place(const Point& p, const AxisValues& like) const {
  AxisValues v = like;
  v[first_] = p.x();
  v[second_] = p.y();
  return v;
}

CutterComp::Point CutterComp::side_normal(const Point& t) const {
  return left_ ? turned_left(t) : Point(-turned_left(t));
}

CutterComp::Point CutterComp::tangent(const Element& e, bool at_end) const {
  if (e.shape == Shape::kLine) return (e.to - e.from).normalized();
  const Point spoke = ((at_end ? e.to : e.from) - e.centre).normalized();
  return e.turn * turned_left(spoke);
}

CutterComp::Element CutterComp::make_element(const CanonCommand& command, std::uint32_t line) const {
  Element e;
  e.command = command;
  e.line = line;
  e.from = plane_point(programmed_);
  e.to = plane_point(target_of(command));
  if (const auto* arc = std::get_if<canon::ArcFeed>(&command)) {
    e.shape = Shape::kArc;
    e.centre = {arc->centre1, arc->centre2};
    e.turn = arc->turns > 0 ? 1 : -1;
  } else {
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
  const bool inside = (e.turn > 0) == left_;
  const double size = (e.from - e.centre).norm();
  e.radius = inside ? size - radius_ : size + radius_;
  if (e.radius <= kTiny * size)
    fail(GcodeErrorCode::kCompCorner, 1,
         fmt::format("the tool of radius {:.4f} does not fit the arc of radius {:.4f}", radius_, size),
         "a smaller tool");
}

// Where the offset curves of two neighbours meet, near their corner.
CutterComp::Point CutterComp::meet(const Element& before, const Element& after) const {
  const Point corner = before.to;
  Point out;
  bool found = false;
  if (before.shape == Shape::kLine && after.shape == Shape::kLine) {
    const Point t1 = tangent(before, true), t2 = tangent(after, false);
    const double c = cross(t1, t2);
    found = std::fabs(c) > kTiny;
    if (found) out = before.b + t1 * (cross(after.a - before.b, t2) / c);
  } else if (before.shape == Shape::kLine) {
    found = line_circle(before.b, tangent(before, true), after.centre, after.radius, corner, out);
  } else if (after.shape == Shape::kLine) {
    found = line_circle(after.a, tangent(after, false), before.centre, before.radius, corner, out);
  } else {
    found = circle_circle(before.centre, before.radius, after.centre, after.radius, corner, out);
  }
  if (!found) gouge(after, before.line);
  return out;
}

void CutterComp::corner(Element& before, Element& after) const {
  const Point t1 = tangent(before, true), t2 = tangent(after, false);
  const double turn = std::atan2(cross(t1, t2), t1.dot(t2));
  const double towards_tool = left_ ? turn : -turn;
  if (std::fabs(turn) < kStraight_rad) {
    after.a = before.b;
  } else if (towards_tool < 0 || std::fabs(turn) > kPi - kTiny) {
    before.rounded = true;
    before.round_to = after.a;
  } else {
    before.b = after.a = meet(before, after);
  }
}

void CutterComp::gouge(const Element& e, std::uint32_t other_line) const {
  fail(GcodeErrorCode::kCompGouge, 1, radius_, e.line, other_line);
}

// An element whose ends have passed each other: its neighbours' corners leave no room for the tool.
void CutterComp::check_direction(const Element& e, std::uint32_t other_line) const {
  if (e.shape == Shape::kLine) {
    if ((e.b - e.a).dot(e.to - e.from) < -kTiny) gouge(e, other_line);
  } else if (!e.entry) {
    const double programmed = sweep_of(e.centre, e.from, e.to, e.turn);
    const double left = sweep_of(e.centre, e.a, e.b, e.turn);
    if (left > programmed + 1e-6 && left > 2 * kPi - programmed) gouge(e, other_line);
  }
}

// The tool beside `e` against the contour before it, and the tool beside that against `e`.
void CutterComp::check_neighbours(const Element& e) {
  if (!e.entry && radius_ > 0) {
    const auto own_path = chain(e.shape == Shape::kArc, e.a, e.b, e.centre, e.turn);
    const auto own_contour = chain(e.shape == Shape::kArc, e.from, e.to, e.centre, e.turn);
    const double least = radius_ * (1 - kTouch) - (e.shape == Shape::kArc ? radius_ * 0.02 : 0);
    double way = (e.to - e.from).norm();
    for (std::size_t i = done_.size(); i-- > 0;) {
      const Element& other = done_[i];
      if (other.entry || way > 2 * kPi * radius_) break;
      way += (other.to - other.from).norm();
      if (i + 1 == done_.size()) continue;  // the neighbour itself was joined at the corner
      const bool arc = other.shape == Shape::kArc;
      const auto path = chain(arc, other.a, other.b, other.centre, other.turn);
      const auto contour = chain(arc, other.from, other.to, other.centre, other.turn);
      const double bound = arc ? std::min(least, radius_ * 0.97) : least;
      if (chain_distance(own_path, contour) < bound || chain_distance(path, own_contour) < bound)
        gouge(e, other.line);
    }
  }
  done_.push_back(e);
  if (done_.size() > kLookBack) done_.pop_front();
}

void CutterComp::move(const CanonCommand& command, std::uint32_t line, CanonSink& sink) {
  Element e = make_element(command, line);
  if (e.shape == Shape::kVertical) {
    programmed_ = target_of(command);
    waiting_.push_back(std::move(e));
    if (!entered_) release(sink);
    return;
  }
  if (!entered_) {
    if (e.shape == Shape::kArc)
      bend_entry(e, Point(e.to + radius_ * side_normal(tangent(e, true))), radius_);
    else if ((e.to - e.from).norm() <= radius_)
      fail(GcodeErrorCode::kCompCorner, 1,
           fmt::format("the entry move is {:.4f} long, the tool's radius {:.4f}", (e.to - e.from).norm(),
                       radius_),
           "a straight move longer than the tool's radius");
    e.entry = true;
    entered_ = true;
  }
  offset(e);
  if (!waiting_.empty()) {
    Element& before = waiting_.front();
    corner(before, e);
    check_direction(before, line);
    check_neighbours(before);
    const bool straight = before.rounded && std::holds_alternative<canon::StraightTraverse>(command);
    const Point round_to = before.round_to;
    if (straight) before.rounded = false;
    release(sink);
    if (straight) {  // a rapid does not follow the corner
      tool_ = place(round_to, tool_);
      sink.put(canon::StraightTraverse{tool_}, line);
    }
  }
  programmed_ = target_of(command);
  waiting_.push_back(std::move(e));
}

void CutterComp::pass(const CanonCommand& command, std::uint32_t line, CanonSink& sink) {
  if (waiting_.empty()) return sink.put(command, line);
  Element e;
  e.command = command;
  e.line = line;
  const auto keep = [&](auto& text) {  // the text must outlive the call
    e.text = std::string(text.text);
  };
  if (auto* message = std::get_if<canon::Message>(&e.command)) keep(*message);
  if (auto* comment = std::get_if<canon::Comment>(&e.command)) keep(*comment);
  if (auto* print = std::get_if<canon::Print>(&e.command)) keep(*print);
  waiting_.push_back(std::move(e));
}

void CutterComp::release(CanonSink& sink) {
  if (waiting_.empty()) return;
  const bool rounded = waiting_.front().rounded;
  const Point about = waiting_.front().to, round_to = waiting_.front().round_to;
  const std::uint32_t line = waiting_.front().line;
  for (; !waiting_.empty(); waiting_.pop_front()) emit(waiting_.front(), sink);
  if (!rounded) return;  // what stood between the two moves happens before the corner
  tool_ = place(round_to, tool_);
  sink.put(canon::ArcFeed{tool_, about.x(), about.y(), left_ ? -1 : 1, plane_, 0}, line);
}

void CutterComp::emit(const Element& e, CanonSink& sink) {
  CanonCommand command = e.command;
  if (e.shape == Shape::kOther) {
    if (auto* message = std::get_if<canon::Message>(&command)) message->text = e.text;
    if (auto* comment = std::get_if<canon::Comment>(&command)) comment->text = e.text;
    if (auto* print = std::get_if<canon::Print>(&command)) print->text = e.text;
    return sink.put(command, e.line);
  }
  AxisValues& to = target_of(command);
  to = place(e.shape == Shape::kVertical ? plane_point(tool_) : e.b, to);
  tool_ = to;
  sink.put(command, e.line);
}

AxisValues CutterComp::finish(CanonSink& sink) {
  if (!waiting_.empty() && is_motion(waiting_.front().command) &&
      waiting_.front().shape != Shape::kVertical) {
    check_direction(waiting_.front(), waiting_.front().line);
    check_neighbours(waiting_.front());
  }
  release(sink);
  active_ = false;
  const AxisValues stands = entered_ ? tool_ : programmed_;
  done_.clear();
  return stands;
}

}  // namespace trn

#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/cutter/gouge_check.h"
#include "interp/gcode/error.h"

namespace trn {

/// Cutter radius compensation (G41, G42 and their kind): takes programmed contour moves, gives the path of
/// the tool's centre. A move waits until the corner after it is known; other commands wait in between.
/// Outside corners are rounded about the corner point, inside corners end where the offset curves meet. A
/// contour beside which there is no path for the tool is refused; a path that gouges is reported
/// (GougeCheck).
class CutterComp {
 public:
  /// `judges`: looks for gouges.
  explicit CutterComp(bool judges) : judges_(judges) {}

  bool active() const { return active_; }
  bool left() const { return left_; }
  double radius() const { return radius_; }

  /// From here on; `from` is the programmed position, `radius` >= 0 in program units, `rounding` as in
  /// GougeCheck; `orientation` 1 to 8 of a lathe's tool, whose controlled point is not its centre.
  void start(bool left, double radius, Plane plane, const ProgramWords& from, double rounding,
             int orientation = 0);
  /// The next programmed traverse, feed or arc. BlockError when there is no path for the tool.
  void move(const CanonCommand& command, const BlockPlace& at, CanonSink& sink);
  /// Any other command, kept in order with the moves.
  void pass(const CanonCommand& command, std::uint32_t line, CanonSink& sink);
  /// Everything that waits, then off. Returns where the tool's centre stands.
  ProgramWords finish(CanonSink& sink);
  /// Behind an error: goes along the programmed contour, unjudged, until the compensation ends.
  void give_up();
  /// The gouges found since the last call, of contours that have ended; at most one of a compensation, and
  /// one of its entry move.
  std::vector<GougeCheck::Gouge> take_gouges() { return check_.take(); }

 private:
  using Point = Eigen::Vector2d;
  enum class Shape : std::uint8_t { kOther, kVertical, kLine, kArc };
  /// A programmed element of the contour, and the tool's centre beside it.
  struct Element {
    Shape shape = Shape::kOther;
    bool entry = false;
    CanonCommand command;
    BlockPlace place;
    std::string text;        ///< of a message that waits
    Point from, to, centre;  ///< programmed
    double from_height = 0, to_height = 0;
    int turn = 0;          ///< arc: +1 counterclockwise
    double radius = 0;     ///< arc of the tool's centre
    Point a, b;            ///< of the tool's centre, corners applied
    double bend_rad = 0;   ///< the sharper of its corners that count as none
    bool rounded = false;  ///< an arc about `to` follows, up to `round_to`
    Point round_to;
  };

  Element make_element(const CanonCommand& command, const BlockPlace& at) const;
  void offset(Element& e) const;
  Point tangent(const Element& e, bool at_end) const;
  Point side_normal(const Point& tangent) const;
  void corner(Element& before, Element& after) const;
  Point meet(const Element& before, const Element& after, const Point& near) const;
  static double curvature(const Element& e);
  void check_arc(const Element& e, std::uint32_t other_line) const;
  void judge(const Element& e);
  void entry_too_short(double length) const;
  [[noreturn]] void gouge(const Element& e, std::uint32_t other_line) const;
  void release(CanonSink& sink);
  void emit(const Element& e, CanonSink& sink);
  Point plane_point(const ProgramWords& v) const { return {v[first_], v[second_]}; }
  ProgramWords place(const Point& p, const ProgramWords& like) const;

  bool active_ = false, left_ = true, entered_ = false, given_up_ = false;
  double radius_ = 0;
  Point shift_ = Point::Zero();  ///< from the tool's centre to its controlled point
  Plane plane_ = Plane::kXY;
  int first_ = kX, second_ = kY, normal_ = kZ;
  ProgramWords programmed_;
  ProgramWords tool_;            ///< tool's centre as last emitted
  std::deque<Element> waiting_;  ///< the first is the last contour element, the rest come after it
  bool judges_;
  GougeCheck check_;
  bool contour_ends_ = false;  ///< behind the element that waits
};

}  // namespace trn

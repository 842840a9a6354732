#include <fmt/format.h>

#include <cmath>

#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/error.h"
#include "interp/gcode/executor.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/settings.h"
#include "interp/gcode/text/block.h"

namespace trn {

namespace {

constexpr double kArcToleranceMost = 100;  // times the least

/// Which words span the plane: first, second and the one along its normal; right-handed.
struct PlaneAxes {
  int first, second, normal;
  std::string_view centre_words;
  std::string_view name;
};

const PlaneAxes& plane_axes(Plane plane) {
  static constexpr PlaneAxes kXyAxes{kX, kY, kZ, "IJ", "G17"};
  static constexpr PlaneAxes kXzAxes{kZ, kX, kY, "KI", "G18"};
  static constexpr PlaneAxes kYzAxes{kY, kZ, kX, "JK", "G19"};
  return plane == Plane::kXY ? kXyAxes : plane == Plane::kXZ ? kXzAxes : kYzAxes;
}

struct Point2 {
  double x, y;
};

// The radius format (RS274/NGC section 3.5.3.1): centre of the arc of |radius| from one point to the other. A
// radius below 0 means the arc of more than half a turn. Two centres have this distance from both points;
// they lie on both sides of the chord, and direction and sign say which is meant. A chord longer than the
// diameter by no more than `slack` is taken for the diameter.
Point2 centre_from_radius(Point2 from, Point2 to, double radius, bool clockwise, double slack,
                          std::uint32_t column) {
  const double dx = to.x - from.x, dy = to.y - from.y;
  double half = std::hypot(dx, dy) / 2;
  const double size = std::fabs(radius);
  if (half == 0) fail(GcodeErrorCode::kArcSamePoint, column);
  if (half - size > slack) fail(GcodeErrorCode::kArcRadius, column, size, 2 * half);
  // Within the slack the two ends and the radius agree but for the last digit. The chord is then the
  // diameter, and the root below is 0 and not the root of something negative.
  half = std::min(half, size);
  const double side = (clockwise == (radius > 0)) ? -1 : 1;
  const double theta = std::atan2(dy, dx) + side * kPi / 2;
  // The centre lies on the middle perpendicular of the chord, at the height of the triangle of two radii and
  // the chord.
  const double offset = size * std::cos(std::asin(half / size));
  return {(from.x + to.x) / 2 + offset * std::cos(theta), (from.y + to.y) / 2 + offset * std::sin(theta)};
}

// The angle of the arc in rad, always positive; `turns` > 0 counterclockwise, and as many turns as P says.
// Equal ends are a full turn, so a sweep of nearly nothing counts as one.
double arc_sweep(Point2 from, Point2 to, Point2 centre, int turns) {
  const double start = std::atan2(from.y - centre.y, from.x - centre.x);
  const double end = std::atan2(to.y - centre.y, to.x - centre.x);
  double sweep = turns > 0 ? end - start : start - end;
  if (sweep <= 1e-9) sweep += 2 * kPi;
  return sweep + 2 * kPi * (std::abs(turns) - 1);
}

}  // namespace

// How far the radii at both ends may differ (centre format, RS274/NGC section 3.5.3.2): a share of the
// greater radius within bounds. A program in inches has the last digit of a tenth of a mil where one in mm
// has a micrometre, so its least bound is greater.
double Executor::arc_tolerance_mm(double radius_mm) const {
  const ProgramConfig& config = parts_.config;
  const double least = config.arc_tolerance_mm * (s_.modal.inch ? kMmPerInch / 10 : 1);
  return std::clamp(config.arc_tolerance_share * radius_mm, least, kArcToleranceMost * least);
}

void Executor::arc(const Block& b, bool clockwise) {
  const PlaneAxes& axes = plane_axes(s_.modal.plane);
  const std::string_view name = clockwise ? "G2" : "G3";
  const std::uint32_t column = b.motion_column();
  check_feed(b, name);
  if (left_contour_)
    fail(GcodeErrorCode::kCompCorner, column, "the first move after G40 is an arc", "a straight move");
  const char i_word = axes.centre_words[0], j_word = axes.centre_words[1];
  // A K in G17 is most often a block that was meant for another plane. K0, which many postprocessors write,
  // does no harm.
  for (const char letter : {'I', 'J', 'K'})
    if (b.has(letter) && letter != i_word && letter != j_word && b[letter] != 0)
      fail(GcodeErrorCode::kPlane, b.at(letter), letter, axes.name, fmt::format("{} and {}", i_word, j_word));
  if (b.has_polar()) check_polar_plane(b);
  const bool by_centre = b.has(i_word) || b.has(j_word);
  if (by_centre == b.has('R')) {
    if (by_centre) fail(GcodeErrorCode::kAxisWordsConflict, b.at('R'), "R", "a centre word");
    fail(GcodeErrorCode::kArcMissing, column, axes.name, fmt::format("R nor {} nor {}", i_word, j_word));
  }
  // Either the centre or the radius must be given, and by now one of them is.
  const double turns = b.get('P', 1);
  const ProgramWords to = target(b);
  const Point2 from{s_.position[axes.first], s_.position[axes.second]};
  const Point2 end{to[axes.first], to[axes.second]};
  Point2 centre{};
  if (by_centre) {
    const bool absolute = s_.modal.arc_absolute;
    if (absolute && !(b.has(i_word) && b.has(j_word)))
      fail(GcodeErrorCode::kMissingWord, column, fmt::format("an arc in G90.1 and {}", axes.name),
           fmt::format("both {} and {}", i_word, j_word));
    centre = absolute ? Point2{b[i_word], b[j_word]}
                      : Point2{from.x + b.get(i_word, 0), from.y + b.get(j_word, 0)};
    const double r1 = std::hypot(from.x - centre.x, from.y - centre.y);
    const double r2 = std::hypot(end.x - centre.x, end.y - centre.y);
    const double gap_mm = to_mm(std::fabs(r1 - r2));
    if (r1 == 0) fail(GcodeErrorCode::kArcNoRadius, column);
    if (gap_mm > arc_tolerance_mm(to_mm(std::max(r1, r2))) || r2 == 0)
      fail(GcodeErrorCode::kArcGap, column, std::fabs(r1 - r2), r1, r2);
    // A micrometre is the last digit of a program in mm and not worth a word.
    if (gap_mm > 1e-3 + 1e-9)
      parts_.warn(
          column,
          fmt::format("the arc's end misses its circle by {:.4f} mm; the centre is moved to fit", gap_mm));
  } else {
    // The slack is the least tolerance: there is no radius at both ends to compare, only a chord against a
    // diameter.
    centre = centre_from_radius(from, end, b['R'], clockwise, from_mm(arc_tolerance_mm(0)), b.at('R'));
  }
  const int signed_turns = clockwise ? -static_cast<int>(turns) : static_cast<int>(turns);
  // G93 gives the time of the whole helix; its length is that of the arc unrolled beside its rise.
  if (s_.modal.feed_mode == FeedMode::kInverseTime) {
    const double radius = std::hypot(from.x - centre.x, from.y - centre.y);
    const double sweep = arc_sweep(from, end, centre, signed_turns);
    set_motion_limits(std::hypot(radius * sweep, to[axes.normal] - s_.position[axes.normal]), b);
  }
  const canon::ArcFeed command{to, centre.x, centre.y, signed_turns, s_.modal.plane, inverse_rate(b)};
  if (comp_.active())
    comp_move(b, command);
  else
    put(command);
  s_.position = to;
}

}  // namespace trn

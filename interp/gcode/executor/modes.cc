#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/error.h"
#include "interp/gcode/executor.h"
#include "interp/gcode/g_code.h"
#include "interp/gcode/modal.h"
#include "interp/gcode/settings.h"
#include "interp/gcode/text/block.h"

namespace trn {

namespace {

constexpr double kLongDwell_s = 100;  // more is rarely meant

}  // namespace

void Executor::feed_mode(const Block& b) {
  const GCode code = b.code(GGroup::kFeedMode);
  set_feed_mode(code == 93_g   ? FeedMode::kInverseTime
                : code == 94_g ? FeedMode::kPerMinute
                               : FeedMode::kPerRevolution);
}

void Executor::set_feed_mode(FeedMode mode) {
  s_.modal.feed_mode = mode;
  note(mode == FeedMode::kInverseTime ? "interpreter: feed mode set to inverse time"
       : mode == FeedMode::kPerMinute ? "interpreter: feed mode set to units per minute"
                                      : "interpreter: feed mode set to units per revolution");
  put(canon::SetFeedMode{mode == FeedMode::kPerRevolution});
  // A feed in mm/min says nothing in mm a turn, so F must be given anew. G94 and G95 forget it; in G93 every
  // line has its own.
  if (mode == FeedMode::kInverseTime) return;
  s_.modal.feed = 0;
  put(canon::SetFeedRate{0});
}

// In G93 the word belongs to its line.
void Executor::feed(const Block& b) {
  if (s_.modal.feed_mode == FeedMode::kInverseTime) return;
  s_.modal.feed = b['F'];
  put(canon::SetFeedRate{b['F']});
}

void Executor::spindle_mode(const Block& b) {
  s_.modal.css = b.code(GGroup::kSpindleMode) == 96_g;
  if (s_.modal.css && !b.has('S'))
    fail(GcodeErrorCode::kMissingWord, b.at(GGroup::kSpindleMode), "G96", "an S word");
  if (b.has('D') && s_.modal.css && b['D'] <= 0)
    fail(GcodeErrorCode::kBadValue, b.at('D'), 'D', b['D'], "G96", "the greatest speed in rpm, above 0");
  // At X0 the speed has no other end.
  const double most = std::min(parts_.config.spindle_rpm_max, parts_.config.spindle_axis.rpm_max);
  if (s_.modal.css && !b.has('D') && !std::isfinite(most))
    fail(GcodeErrorCode::kMissingWord, b.at(GGroup::kSpindleMode), "G96",
         "D, the greatest speed in rpm, or 'rpm_max' in the config's [io.spindle]");
  s_.modal.css_max = s_.modal.css ? b.get('D', 1e30) : 0;
  put(canon::SetSpindleMode{s_.modal.css_max});
}

void Executor::speed(const Block& b) {
  if (!s_.modal.css && b['S'] > parts_.config.spindle_rpm_max)
    fail(GcodeErrorCode::kBadValue, b.at('S'), 'S', b['S'], "the spindle",
         fmt::format("{:g} rpm at most, as 'rpm_max' in the config's [io.spindle] says",
                     parts_.config.spindle_rpm_max));
  s_.modal.speed = b['S'];
  put(canon::SetSpindleSpeed{b['S']});
}

void Executor::plane(const Block& b) {
  const GCode code = b.code(GGroup::kPlane);
  const Plane plane = code == 17_g ? Plane::kXY : code == 18_g ? Plane::kXZ : Plane::kYZ;
  if (comp_.active() && plane != s_.modal.plane)
    fail(GcodeErrorCode::kCompState, b.at(GGroup::kPlane), "a change of plane");
  s_.modal.plane = plane;
  put(canon::SelectPlane{plane});
}

void Executor::units(const Block& b) {
  const bool inch = b.code(GGroup::kUnits) == 20_g;
  if (comp_.active() && inch != s_.modal.inch)
    fail(GcodeErrorCode::kCompState, b.at(GGroup::kUnits), "a change of units");
  set_units(inch);
}

void Executor::set_units(bool inch) {
  put(canon::UseLengthUnits{inch});
  if (inch == s_.modal.inch) return;
  // The machine stands still. All that is kept in program units changes its number so that it means the same
  // place and the same length.
  const double factor = inch ? 1 / kMmPerInch : kMmPerInch;
  for (ProgramWords* v : {&s_.position, &s_.g5x, &s_.g92, &s_.tool_offset}) v->xyz *= factor;
  s_.tilt_origin *= factor;
  s_.modal.path_tolerance *= factor;
  s_.modal.naive_tolerance *= factor;
  s_.modal.inch = inch;
}

void Executor::path_mode(const Block& b) {
  const GCode code = b.code(GGroup::kPath);
  if (comp_.active()) fail(GcodeErrorCode::kCompState, b.at(GGroup::kPath), g_name(code));
  for (const char letter : {'P', 'Q', 'R'})
    if (code == 64_g && b.has(letter) && b[letter] < 0)
      fail(GcodeErrorCode::kBadValue, b.at(letter), letter, b[letter], "G64", "a tolerance of 0 or more");
  if (code != 64_g)
    return set_path(code == 61_g ? MotionControl::kExactPath : MotionControl::kExactStop, 0, 0, 0);
  // "G64 P0.01" means 0.01 for both the corners and the joining of short lines; G64 alone means no bound of
  // its own, which the config gives then.
  const double tolerance = b.get('P', 0);
  set_path(MotionControl::kContinuous, tolerance, b.get('Q', tolerance), b.get('R', 0));
}

void Executor::set_path(MotionControl mode, double tolerance, double naive, double orientation_deg) {
  s_.modal.path = mode;
  if (mode == MotionControl::kContinuous) {
    s_.modal.path_tolerance = tolerance;
    s_.modal.naive_tolerance = naive;
    s_.modal.orientation_deg = orientation_deg;
  }
  put_path();
}

void Executor::set_great_circle(bool on) {
  if (s_.modal.great_circle == on) return;
  s_.modal.great_circle = on;
  put(canon::SetOrientationPath{on});
}

void Executor::put_path() {
  const ModalState& m = s_.modal;
  put(canon::SetMotionControlMode{m.path, m.path_tolerance, m.orientation_deg});
  if (m.path == MotionControl::kContinuous) put(canon::SetNaivecamTolerance{m.naive_tolerance});
}

void Executor::distance(const Block& b) {
  const GCode code = b.code(GGroup::kDistance);
  if (code != kNoGCode && (code == 91_g) != s_.modal.incremental) set_incremental(code == 91_g);
  const GCode arc_code = b.code(GGroup::kArcDistance);
  if (arc_code != kNoGCode && (arc_code == 90.1_g) != s_.modal.arc_absolute)
    set_arc_absolute(arc_code == 90.1_g);
}

void Executor::set_incremental(bool incremental) {
  s_.modal.incremental = incremental;
  note(incremental ? "interpreter: distance mode changed to incremental"
                   : "interpreter: distance mode changed to absolute");
}

void Executor::set_arc_absolute(bool absolute) {
  s_.modal.arc_absolute = absolute;
  note(absolute ? "interpreter: IJK distance mode changed to absolute"
                : "interpreter: IJK distance mode changed to incremental");
}

void Executor::set_diameter(bool diameter) {
  s_.modal.diameter = diameter;
  note(diameter ? "interpreter: Lathe diameter mode changed to diameter"
                : "interpreter: Lathe diameter mode changed to radius");
}

void Executor::retract(const Block& b) {
  if (comp_.active())
    fail(GcodeErrorCode::kCompState, b.at(GGroup::kRetract), g_name(b.code(GGroup::kRetract)));
  set_retract(b.code(GGroup::kRetract) == 98_g);
}

void Executor::set_retract(bool to_start) {
  s_.modal.retract_to_start = to_start;
  note(to_start ? "interpreter: retract mode set to old_z" : "interpreter: retract mode set to r_plane");
}

void Executor::dwell(const Block& b) {
  if (!b.has('P')) fail(GcodeErrorCode::kMissingWord, b.at(GGroup::kNonModal), "G4", "a P word, seconds");
  if (b['P'] < 0) fail(GcodeErrorCode::kBadValue, b.at('P'), 'P', b['P'], "G4", "P of 0 or more seconds");
  warn_long_dwell(b, "G4");
  put(canon::Dwell{b['P']});
}

// Of the code that is called `name`; once in a program.
void Executor::warn_long_dwell(const Block& b, std::string_view name) {
  if (warned_dwell_ || !b.has('P') || b['P'] < kLongDwell_s || b['P'] != std::round(b['P'])) return;
  parts_.warn(
      b.at('P'),
      fmt::format("{0} P{1:g} waits {1:g} seconds; controls that count in milliseconds mean {0} P{2:g}", name,
                  b['P'], b['P'] / 1000));
  warned_dwell_ = true;
}

}  // namespace trn

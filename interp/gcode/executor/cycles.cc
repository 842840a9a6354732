#include <fmt/format.h>

#include <cmath>

#include "core/check.h"
#include "core/frames.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/error.h"
#include "interp/gcode/executor.h"
#include "interp/gcode/g_code.h"
#include "interp/gcode/modal.h"
#include "interp/gcode/settings.h"
#include "interp/gcode/text/block.h"

// Canned cycles (RS274/NGC section 3.5.16) in the three planes, and G183 (docs/sources.md S3.4).
namespace trn {

namespace {

constexpr double kRepeatsMax = 1e6;
constexpr int kPecksMax = 10000;  // of one hole

bool needs_dwell(GCode motion) {
  return motion == 82_g || motion == 86_g || motion == 88_g || motion == 89_g;
}

}  // namespace

struct Executor::CycleAxes {
  int first, second, depth;
};

Executor::CycleAxes Executor::cycle_axes(Plane plane) {
  return plane == Plane::kXY   ? CycleAxes{kX, kY, kZ}
         : plane == Plane::kXZ ? CycleAxes{kX, kZ, kY}
                               : CycleAxes{kY, kZ, kX};
}

struct Executor::Hole {
  CycleAxes axes;
  double first, second;
  double r, bottom, clear, middle;
  ProgramWords base;  ///< the words the cycle does not move
};

void Executor::check_cycle_spindle(GCode motion, std::uint32_t column) const {
  const SpindleTurn turn = s_.modal.turn;
  // A right-hand tap must turn clockwise on its way in. With the spindle the wrong way round it would be
  // pressed into the hole.
  const bool right_hand = motion == 84_g, left_hand = motion == 74_g;
  if (turn == SpindleTurn::kStopped) {
    if (right_hand || left_hand || (motion >= 86_g && motion <= 88_g))
      fail(GcodeErrorCode::kNoSpindle, column,
           right_hand  ? "G84 (M3)"
           : left_hand ? "G74 (M4)"
                       : g_name(motion));
  } else if (right_hand && turn != SpindleTurn::kClockwise) {
    fail(GcodeErrorCode::kSpindleDirection, column, "G84", "clockwise", "counterclockwise");
  } else if (left_hand && turn != SpindleTurn::kCounterclockwise) {
    fail(GcodeErrorCode::kSpindleDirection, column, "G74", "counterclockwise", "clockwise");
  }
}

// A word given now, or kept from the block before when the same cycle goes on.
void Executor::cycle_word(const Block& b, GCode motion, char letter, double& kept) {
  if (b.has(letter))
    kept = b[letter];
  else if (s_.motion != motion)
    fail(GcodeErrorCode::kMissingWord, b.motion_column(), g_name(motion), fmt::format("a word {}", letter));
}

// What one of the cycles needs beside the hole: dwell, peck, way of the back boring tool.
void Executor::cycle_words(const Block& b, GCode motion) {
  if (needs_dwell(motion))
    cycle_word(b, motion, 'P', s_.cycle.p);
  else
    s_.cycle.p = b.get('P', s_.cycle.p);
  if (b.has('P') && b['P'] < 0)
    fail(GcodeErrorCode::kBadValue, b.at('P'), 'P', b['P'], g_name(motion), "a dwell of 0 or more seconds");
  warn_long_dwell(b, g_name(motion));
  if (motion == 73_g || motion == 83_g) cycle_word(b, motion, 'Q', s_.cycle.q);
  if (b.has('Q') && b['Q'] < 0) bad_peck(b, motion);
  if (motion != 87_g) return;
  cycle_word(b, motion, 'I', s_.cycle.i);
  cycle_word(b, motion, 'J', s_.cycle.j);
  cycle_word(b, motion, 'K', s_.cycle.k);
}

void Executor::bad_peck(const Block& b, GCode motion) const {
  fail(GcodeErrorCode::kBadValue, b.at('Q'), 'Q', b['Q'], g_name(motion), "a peck greater than 0");
}

// The pecks of a hole are made at once, and one too small for its digits would never come to the bottom.
void Executor::check_peck(const Block& b, GCode motion, const Hole& hole) const {
  const double q = s_.cycle.q;
  if (q <= 0) bad_peck(b, motion);
  if (hole.r - hole.bottom > kPecksMax * q)
    fail(GcodeErrorCode::kBadValue, b.has('Q') ? b.at('Q') : b.motion_column(), 'Q', q, g_name(motion),
         fmt::format("a peck of which {} reach the bottom", kPecksMax));
}

void Executor::cycle(const Block& b, GCode motion) {
  const std::uint32_t column = b.motion_column();
  const std::string name = g_name(motion);
  if (motion == 76_g) return threading_cycle(b);
  if (comp_.active()) fail(GcodeErrorCode::kCompState, column, name);
  if (s_.modal.feed_mode == FeedMode::kInverseTime) fail(GcodeErrorCode::kFeedModeCycle, column, name, "G93");
  check_feed(b, name);
  const double repeats = b.get('L', 1);
  if (repeats < 1 || repeats > kRepeatsMax)
    fail(GcodeErrorCode::kBadValue, b.at('L'), 'L', repeats, name, "a whole number of repeats from 1");
  const CycleAxes axes = cycle_axes(s_.modal.plane);
  cycle_word(b, motion, 'R', s_.cycle.r);
  cycle_word(b, motion, kWordLetters[axes.depth], s_.cycle.bottom);
  // The height before the first cycle of a series is what G98 goes back to (RS274/NGC section 3.5.20).
  if (s_.motion < 73_g || s_.motion == 80_g) s_.cycle.initial = s_.position[axes.depth];
  Hole hole = first_hole(b, axes);
  if (hole.bottom > hole.r)
    fail(GcodeErrorCode::kCycle, column,
         fmt::format("{}: R {:.4f} lies below the bottom {:.4f}", name, hole.r, hole.bottom),
         "R above the bottom");
  TRN_CHECK(!(hole.bottom > hole.r));
  // Preliminary motion (RS274/NGC section 3.5.16.1): from below R the tool first rises to R where it stands;
  // between the holes it moves at `height`.
  double height = s_.position[axes.depth];
  if (s_.modal.retract_to_start) height = std::max(s_.cycle.initial, height);
  if (height < hole.r || s_.cycle.initial < hole.r) {
    cycle_to(hole, s_.position[axes.first], s_.position[axes.second], hole.r, true);
    height = hole.r;
  }
  // G98 retracts to the height before the series, G99 to R. A series that began below R never goes below R.
  hole.clear = s_.modal.retract_to_start ? std::max(s_.cycle.initial, hole.r) : hole.r;
  TRN_CHECK(hole.clear >= hole.r);
  // A cycle is drilled in exact path mode, so that no corner at the bottom of a hole is rounded off.
  const bool was_exact = s_.modal.path == MotionControl::kExactPath;
  if (!was_exact) put(canon::SetMotionControlMode{MotionControl::kExactPath, 0, 0});
  cycle_words(b, motion);
  hole.middle = s_.modal.incremental ? hole.bottom + s_.cycle.k : s_.cycle.k;
  drill(b, motion, hole, height, static_cast<int>(repeats));
  if (was_exact) return;
  put_path();
  if (s_.modal.path != MotionControl::kContinuous) put(canon::SetNaivecamTolerance{s_.modal.naive_tolerance});
}

// The hole that the words mean. In G91 R counts from the height where the series began, the bottom from R,
// and X and Y are the step from hole to hole, which `drill` takes before each of them.
Executor::Hole Executor::first_hole(const Block& b, const CycleAxes& axes) const {
  Hole hole{axes,       s_.position[axes.first], s_.position[axes.second], s_.cycle.r, s_.cycle.bottom, 0, 0,
            s_.position};
  if (s_.modal.incremental) {
    hole.r += s_.cycle.initial;
    hole.bottom += hole.r;
  }
  if (b.has_polar()) check_polar_plane(b);
  if (s_.modal.incremental) return hole;
  if (b.has_polar()) {
    polar(b, hole.first, hole.second);
  } else {
    hole.first = b.get(kWordLetters[axes.first], hole.first);
    hole.second = b.get(kWordLetters[axes.second], hole.second);
  }
  return hole;
}

// The holes of one block: L of them in G91, each a step further; in G90 they are all the same hole.
void Executor::drill(const Block& b, GCode motion, Hole& hole, double height, int repeats) {
  TRN_CHECK(repeats >= 1);
  const CycleAxes axes = hole.axes;
  for (int i = 0; i < repeats; ++i) {
    if (s_.modal.incremental && b.has_polar()) {
      polar(b, hole.first, hole.second);
    } else if (s_.modal.incremental) {
      // "G91 X10 L5" while G81 is in force: five more holes, each 10 further.
      hole.first += b.get(kWordLetters[axes.first], 0);
      hole.second += b.get(kWordLetters[axes.second], 0);
    }
    cycle_to(hole, hole.first, hole.second, height, true);
    if (height != hole.r) cycle_to(hole, hole.first, hole.second, hole.r, true);
    check_cycle_spindle(motion, b.motion_column());
    if (motion == 73_g || motion == 83_g) check_peck(b, motion, hole);
    cycle_hole(motion, hole);
    height = hole.clear;
  }
  s_.position[axes.first] = hole.first;
  s_.position[axes.second] = hole.second;
  s_.position[axes.depth] = hole.clear;
}

void Executor::cycle_to(const Hole& hole, double first, double second, double depth, bool traverse) {
  ProgramWords to = hole.base;
  to[hole.axes.first] = first;
  to[hole.axes.second] = second;
  to[hole.axes.depth] = depth;
  if (traverse)
    put(canon::StraightTraverse{to});
  else
    put(canon::StraightFeed{to, 0});
}

// One hole, from R down and up to the clear height (RS274/NGC sections 3.5.16.2 to 3.5.16.10).
void Executor::cycle_hole(GCode motion, const Hole& hole) {
  const auto feed = [&](double depth) { cycle_to(hole, hole.first, hole.second, depth, false); };
  const auto rapid = [&](double depth) { cycle_to(hole, hole.first, hole.second, depth, true); };
  const auto dwell_here = [&] { put(canon::Dwell{s_.cycle.p}); };
  const SpindleTurn turn = s_.modal.turn;
  switch (motion) {
    case 73_g:
      return peck(hole, false);
    case 83_g:
      return peck(hole, true);
    case 74_g:
    case 84_g:
      return tap(hole, motion == 84_g);
    case 87_g:
      return back_bore(hole);
    default:
      break;
  }
  feed(hole.bottom);
  switch (motion) {
    case 81_g:
      return rapid(hole.clear);
    case 82_g:
      dwell_here();
      return rapid(hole.clear);
    case 85_g:
      feed(hole.r);
      return rapid(hole.clear);
    case 86_g:
      dwell_here();
      stop_spindle();
      rapid(hole.clear);
      return start_spindle(turn);
    case 88_g: {
      dwell_here();
      stop_spindle();
      // G88: the program stops at the bottom, so that the operator may draw the tool back by hand. What is
      // left of the way up follows when it goes on.
      put(PlainCanon::kProgramStop);
      ProgramWords up = hole.base;
      up[hole.axes.first] = hole.first;
      up[hole.axes.second] = hole.second;
      up[hole.axes.depth] = hole.clear;
      put(canon::ManualRetract{up});
      return start_spindle(turn);
    }
    default:
      dwell_here();
      return feed(hole.clear);
  }
}

// G83 retracts to R behind every peck, so that the chips come out; G73 only by the clearance, so that they
// break. The rapid back down stops the clearance above the depth that has been drilled.
void Executor::peck(const Hole& hole, bool full_retract) {
  TRN_CHECK(s_.cycle.q > 0);
  const double clearance = from_mm(parts_.config.peck_clearance_mm);
  // The last peck is what is left, and goes exactly to the bottom.
  for (double depth = hole.r - s_.cycle.q; depth > hole.bottom; depth -= s_.cycle.q) {
    cycle_to(hole, hole.first, hole.second, depth, false);
    if (full_retract) cycle_to(hole, hole.first, hole.second, hole.r, true);
    cycle_to(hole, hole.first, hole.second, depth + clearance, true);
  }
  cycle_to(hole, hole.first, hole.second, hole.bottom, false);
  cycle_to(hole, hole.first, hole.second, hole.clear, true);
}

// G84 and G74 with a floating holder: feed and speed must keep their ratio, so neither override acts; at the
// bottom the spindle turns round, and the tool is fed out.
void Executor::tap(const Hole& hole, bool right_hand) {
  const bool feed_override = s_.modal.feed_override, speed_override = s_.modal.speed_override;
  put(PlainCanon::kDisableFeedOverride);
  put(PlainCanon::kDisableSpeedOverride);
  cycle_to(hole, hole.first, hole.second, hole.bottom, false);
  stop_spindle();
  start_spindle(right_hand ? SpindleTurn::kCounterclockwise : SpindleTurn::kClockwise);
  put(canon::Dwell{s_.cycle.p});
  cycle_to(hole, hole.first, hole.second, hole.clear, false);
  stop_spindle();
  start_spindle(right_hand ? SpindleTurn::kClockwise : SpindleTurn::kCounterclockwise);
  if (feed_override) put(PlainCanon::kEnableFeedOverride);
  if (speed_override) put(PlainCanon::kEnableSpeedOverride);
}

// G87: in beside the hole, across, up against the far side, and the same way back.
void Executor::back_bore(const Hole& hole) {
  const SpindleTurn turn = s_.modal.turn;
  const double side_first = hole.first + s_.cycle.i, side_second = hole.second + s_.cycle.j;
  const int direction = turn == SpindleTurn::kClockwise ? 2 : 3;  // as the canonical functions number them
  cycle_to(hole, side_first, side_second, hole.r, true);
  stop_spindle();
  // The tip must point away from the wall while the tool passes sideways; at any other angle it would scratch
  // the bore.
  put(canon::OrientSpindle{0, direction});
  cycle_to(hole, side_first, side_second, hole.bottom, true);
  cycle_to(hole, hole.first, hole.second, hole.bottom, true);
  start_spindle(turn);
  cycle_to(hole, hole.first, hole.second, hole.middle, false);
  cycle_to(hole, hole.first, hole.second, hole.bottom, false);
  stop_spindle();
  put(canon::OrientSpindle{0, direction});
  cycle_to(hole, side_first, side_second, hole.bottom, true);
  cycle_to(hole, side_first, side_second, hole.clear, true);
  cycle_to(hole, hole.first, hole.second, hole.clear, true);
  start_spindle(turn);
}

// G183 X Y Z A B C H Q R: at the point (X, Y, Z), along the tool axis that the rotary words give, to the
// depth H in Q equal pecks, from the clearance R and back to it. The tip moves in the table frame, so the
// hole is straight whatever the machine does. Modal: later blocks with axis words drill the same hole
// elsewhere.
void Executor::tilted_drilling(const Block& b) {
  const std::uint32_t column = b.motion_column();
  if (comp_.active()) fail(GcodeErrorCode::kCompState, column, "G183");
  if (s_.modal.feed_mode == FeedMode::kInverseTime)
    fail(GcodeErrorCode::kFeedModeCycle, column, "G183", "G93");
  check_feed(b, "G183");
  const bool goes_on = s_.motion == 183_g;
  if (b.has('H')) s_.cycle.h = b['H'];
  if (!goes_on && !b.has('H')) fail(GcodeErrorCode::kMissingWord, column, "G183", "an H word, the depth");
  if (!(s_.cycle.h < 0))
    fail(GcodeErrorCode::kBadValue, b.at('H'), 'H', s_.cycle.h, "G183", "a depth below 0");
  // In a series each word stays until it is given anew. The first block of a series takes the defaults: one
  // peck, and the clearance of the config.
  if (b.has('Q') || !goes_on) s_.cycle.q = b.get('Q', 1);
  if (b.has('R') || !goes_on) s_.cycle.retract = b.get('R', from_mm(parts_.config.g183_retract_mm));
  const double pecks = s_.cycle.q;
  if (pecks < 1 || pecks != std::round(pecks) || pecks > kPecksMax)
    fail(GcodeErrorCode::kBadValue, b.at('Q'), 'Q', pecks, "G183", "a whole number of pecks from 1");
  if (s_.cycle.retract < 0)
    fail(GcodeErrorCode::kBadValue, b.at('R'), 'R', s_.cycle.retract, "G183", "R of 0 or more");

  const bool was_on = s_.rtcp;
  // The hole's axis is straight in the work only if the tip is what moves. The machine stands still while
  // RTCP is switched on.
  if (!was_on) set_rtcp(true, s_.tool_offset, column, "G183");
  const ProgramWords mouth = target(b);
  // The kinematics gives the tool axis in the table frame B; the words of the block are in program axes P.
  const Mat3 R_PB = (parts_.kinematics->home_X_BM().R * frame().X_MP().R).transpose();
  const Vec3 axis = R_PB * parts_.kinematics->orientation(orientation_abc_rad(mouth)).col(2);
  TRN_CHECK(std::abs(axis.norm() - 1) < 1e-9);
  const auto along = [&](double distance) {
    ProgramWords to = mouth;
    to.xyz += distance * axis;
    return to;
  };
  const ProgramWords clear = along(s_.cycle.retract);
  put(canon::StraightTraverse{clear});
  const int count = static_cast<int>(pecks);
  TRN_CHECK(count >= 1);
  TRN_CHECK(s_.cycle.h < 0 && s_.cycle.retract >= 0);
  const double clearance = from_mm(parts_.config.peck_clearance_mm);
  for (int i = 1; i <= count; ++i) {
    const double before = s_.cycle.h * (i - 1) / count;
    // Back to just above what is drilled, but never higher than the clear plane, from which it has just come.
    if (i > 1) put(canon::StraightTraverse{along(before + std::min(clearance, s_.cycle.retract - before))});
    put(canon::StraightFeed{along(s_.cycle.h * i / count), 0});
    put(canon::StraightTraverse{clear});
  }
  s_.position = clear;
  if (!was_on) set_rtcp(false, s_.tool_offset, column, "G183");
}

}  // namespace trn

#pragma once

#include <array>
#include <cstdint>

#include "core/frames.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/g_code.h"
#include "interp/gcode/modal.h"

namespace trn {

enum class FeedMode : std::uint8_t { kPerMinute, kInverseTime, kPerRevolution };
enum class SpindleTurn : std::uint8_t { kStopped, kClockwise, kCounterclockwise };

/// What M70 keeps and M72 brings back.
struct ModalState {
  Plane plane = Plane::kXY;
  bool inch = false;
  bool incremental = false;
  bool arc_absolute = false;
  bool diameter = false;
  bool retract_to_start = false;  ///< G98
  FeedMode feed_mode = FeedMode::kPerMinute;
  double feed = 0;   ///< program units per minute, moves per minute or units per revolution
  double speed = 0;  ///< rpm, or surface speed in G96
  double css_max = 0;
  bool css = false;
  SpindleTurn turn = SpindleTurn::kStopped;
  bool mist = false, flood = false;
  bool feed_override = true, speed_override = true, adaptive_feed = false, feed_hold = true;
  MotionControl path = MotionControl::kContinuous;
  double path_tolerance = 0;  ///< program units
  double naive_tolerance = 0;
  double orientation_deg = 0;
  bool great_circle = false;  ///< the tool axis goes the shortest way with RTCP on
  int work_offset = 1;        ///< 1: G54 .. 9: G59.3

  bool operator==(const ModalState&) const = default;
};

/// Words of a canned cycle that stay in force while the same cycle goes on.
struct CycleWords {
  double initial = 0;  ///< height along the hole's axis where the series of cycles began
  double r = 0, bottom = 0, p = 0, q = 0, i = 0, j = 0, k = 0, h = 0, retract = 0;

  bool operator==(const CycleWords&) const = default;
};

/// The whole state of the language: lengths in the current program units, angles in degrees.
struct Settings {
  ModalState modal;
  GCode motion = 80_g;    ///< active motion code; G80: none
  ProgramWords position;  ///< program coordinates
  ProgramWords g5x;
  ProgramWords g92;
  bool g92_active = false;  ///< as #5210
  double rotation_deg = 0;
  ProgramWords tool_offset;
  GCode tool_length_code = 49_g;
  int selected_tool = -1;
  int current_tool = 0;
  CycleWords cycle;
  std::int32_t switched_on = 0, switched_off = 0;  ///< corrections that the program has switched, as bits
  bool rtcp = false;
  bool tool_vector = false;      ///< G43.5
  bool spindle_is_axis = false;  ///< M154
  bool knife = false;            ///< the tangential knife follows the path
  bool tilted = false, tilted_aligned = false;
  Vec3 tilt_origin = Vec3::Zero();
  Mat3 R_tilt = Mat3::Identity();

  bool operator==(const Settings&) const = default;
};

}  // namespace trn

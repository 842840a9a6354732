#include "interp/gcode/active_codes.h"

#include <fmt/format.h>

#include <iterator>

#include "interp/gcode/canon.h"
#include "interp/gcode/modal.h"

namespace trn {

namespace {

GCode feed_code(FeedMode mode) {
  switch (mode) {
    case FeedMode::kInverseTime:
      return 93_g;
    case FeedMode::kPerMinute:
      return 94_g;
    case FeedMode::kPerRevolution:
      return 95_g;
  }
  return kNoGCode;
}

GCode path_code(MotionControl path) {
  switch (path) {
    case MotionControl::kExactStop:
      return 61.1_g;
    case MotionControl::kExactPath:
      return 61_g;
    case MotionControl::kContinuous:
      return 64_g;
  }
  return kNoGCode;
}

GCode code_of(Plane plane) { return plane == Plane::kXY ? 17_g : plane == Plane::kXZ ? 18_g : 19_g; }

const char* spindle_code(SpindleTurn turn) {
  return turn == SpindleTurn::kStopped ? "M5" : turn == SpindleTurn::kClockwise ? "M3" : "M4";
}

}  // namespace

std::string active_codes(const Settings& settings, GCode cutter_comp) {
  const ModalState& m = settings.modal;
  std::string text;
  const auto put = [&](GCode code) { fmt::format_to(std::back_inserter(text), "{} ", g_name(code)); };
  for (const GCode code :
       {settings.motion, code_of(m.plane), m.inch ? 20_g : 21_g, m.incremental ? 91_g : 90_g,
        m.arc_absolute ? 90.1_g : 91.1_g, feed_code(m.feed_mode),
        kWorkOffsetCodes[static_cast<std::size_t>(m.work_offset - 1)], settings.tool_length_code,
        m.retract_to_start ? 98_g : 99_g, path_code(m.path)})
    put(code);
  if (m.path == MotionControl::kContinuous && m.path_tolerance > 0)
    fmt::format_to(std::back_inserter(text), "P{:g} ", m.path_tolerance);
  put(cutter_comp);
  if (settings.g92_active) put(92_g);
  if (settings.tilted) put(68.2_g);
  if (settings.spindle_is_axis) text += "SPINDLE-AXIS ";
  if (settings.knife) text += "TANGON ";
  put(m.css ? 96_g : 97_g);
  if (m.diameter) put(7_g);
  text += spindle_code(m.turn);
  if (m.mist) text += " M7";
  if (m.flood) text += " M8";
  if (!m.mist && !m.flood) text += " M9";
  text += m.feed_override && m.speed_override ? " M48"
          : m.feed_override                   ? " M51 P0"
          : m.speed_override                  ? " M50 P0"
                                              : " M49";
  return text;
}

}  // namespace trn

#include "interp/gcode/canon_printer.h"

#include <fmt/format.h>

#include <array>
#include <initializer_list>
#include <iterator>

#include "core/frames.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/text/fixed_decimal.h"

namespace trn {

namespace {

constexpr std::array<std::string_view, static_cast<std::size_t>(PlainCanon::kFinish) + 1> kPlainNames = {
    "ON_RESET()",
    "SET_FEED_REFERENCE(CANON_XYZ)",
    "MIST_ON()",
    "MIST_OFF()",
    "FLOOD_ON()",
    "FLOOD_OFF()",
    "START_CHANGE()",
    "ENABLE_FEED_OVERRIDE()",
    "DISABLE_FEED_OVERRIDE()",
    "ENABLE_SPEED_OVERRIDE(0)",
    "DISABLE_SPEED_OVERRIDE(0)",
    "ENABLE_ADAPTIVE_FEED()",
    "DISABLE_ADAPTIVE_FEED()",
    "ENABLE_FEED_HOLD()",
    "DISABLE_FEED_HOLD()",
    "TURN_PROBE_ON()",
    "TURN_PROBE_OFF()",
    "STOP_SPEED_FEED_SYNCH()",
    "PALLET_SHUTTLE()",
    "PROGRAM_STOP()",
    "OPTIONAL_PROGRAM_STOP()",
    "PROGRAM_END()",
    "FINISH()"};
static_assert(!kPlainNames.back().empty());  // a row for each

template <typename... Args>
void add(std::string& out, fmt::format_string<Args...> format, Args&&... args) {
  fmt::format_to(std::back_inserter(out), format, std::forward<Args>(args)...);
}

// "NAME(1.0000, 2.0000)". Most of a canonical stream is moves: their numbers have a writer of their own, and
// fmt, which writes the same ten times slower, takes what that leaves.
void add_numbers(std::string& out, std::string_view name, std::initializer_list<double> values) {
  out.append(name);
  char separator = '(';
  for (const double value : values) {
    std::array<char, kFourDecimalsMax> text;
    out += separator;
    if (separator == ',') out += ' ';
    separator = ',';
    if (const char* const end = write_four_decimals(text.data(), value))
      out.append(text.data(), static_cast<std::size_t>(end - text.data()));
    else
      add(out, "{:.4f}", value);
  }
  out += ')';
}

void add_axes(std::string& out, std::string_view name, const ProgramWords& v) {
  add_numbers(out, name, {v[0], v[1], v[2], v[3], v[4], v[5]});
}

std::string_view plane_name(Plane plane) {
  return plane == Plane::kXY ? "XY" : plane == Plane::kXZ ? "XZ" : "YZ";
}

/// One overload a command; commands without a canonical form print nothing.
struct Print {
  std::string& out;

  void operator()(const canon::Plain& c) const { out += kPlainNames[static_cast<std::size_t>(c.what)]; }
  void operator()(const canon::UseLengthUnits& c) const {
    add(out, "USE_LENGTH_UNITS(CANON_UNITS_{})", c.inch ? "INCHES" : "MM");
  }
  void operator()(const canon::SelectPlane& c) const {
    add(out, "SELECT_PLANE(CANON_PLANE_{})", plane_name(c.plane));
  }
  void operator()(const canon::SetG5xOffset& c) const {
    const ProgramWords& v = c.offset;
    add(out, "SET_G5X_OFFSET({}, {:.4f}, {:.4f}, {:.4f}, {:.4f}, {:.4f}, {:.4f})", c.index, v[0], v[1], v[2],
        v[3], v[4], v[5]);
  }
  void operator()(const canon::SetG92Offset& c) const { add_axes(out, "SET_G92_OFFSET", c.offset); }
  void operator()(const canon::SetXyRotation& c) const { add(out, "SET_XY_ROTATION({:.4f})", c.deg); }
  void operator()(const canon::UseToolLengthOffset& c) const {
    const ProgramWords& v = c.offset;
    add(out, "USE_TOOL_LENGTH_OFFSET({:.4f} {:.4f} {:.4f}, {:.4f} {:.4f} {:.4f}, 0.0000 0.0000 0.0000)", v[0],
        v[1], v[2], v[3], v[4], v[5]);
  }
  void operator()(const canon::SetFeedRate& c) const { add_numbers(out, "SET_FEED_RATE", {c.per_min}); }
  void operator()(const canon::SetFeedMode& c) const { add(out, "SET_FEED_MODE(0, {})", c.mode); }
  void operator()(const canon::SetMotionControlMode& c) const {
    if (c.mode == MotionControl::kContinuous)
      add(out, "SET_MOTION_CONTROL_MODE(CANON_CONTINUOUS, {:.6f})", c.tolerance);
    else
      add(out, "SET_MOTION_CONTROL_MODE(CANON_EXACT_{})",
          c.mode == MotionControl::kExactPath ? "PATH" : "STOP");
  }
  void operator()(const canon::SetNaivecamTolerance& c) const {
    add(out, "SET_NAIVECAM_TOLERANCE({:.4f})", c.tolerance);
  }
  void operator()(const canon::StraightTraverse& c) const { add_axes(out, "STRAIGHT_TRAVERSE", c.to); }
  void operator()(const canon::StraightFeed& c) const { add_axes(out, "STRAIGHT_FEED", c.to); }
  void operator()(const canon::ArcFeed& c) const {
    const bool xy = c.plane == Plane::kXY, xz = c.plane == Plane::kXZ;
    const double end1 = c.to[xy ? kX : xz ? kZ : kY], end2 = c.to[xy ? kY : xz ? kX : kZ];
    const double end3 = c.to[xy ? kZ : xz ? kY : kX];
    add(out, "ARC_FEED({:.4f}, {:.4f}, {:.4f}, {:.4f}, {}, {:.4f}, {:.4f}, {:.4f}, {:.4f})", end1, end2,
        c.centre1, c.centre2, c.turns, end3, c.to[kA], c.to[kB], c.to[kC]);
  }
  void operator()(const canon::ManualRetract&) const {}
  void operator()(const canon::StraightProbe& c) const { add_axes(out, "STRAIGHT_PROBE", c.to); }
  void operator()(const canon::RigidTap& c) const {
    add(out, "RIGID_TAP({:.4f}, {:.4f}, {:.4f})", c.to[0], c.to[1], c.to[2]);
  }
  void operator()(const canon::NurbsFeed& c) const { add(out, "NURBS_FEED({}, ...)", c.control_points); }
  void operator()(const canon::Dwell& c) const { add(out, "DWELL({:.4f})", c.s); }
  void operator()(const canon::SetSpindleMode& c) const { add(out, "SET_SPINDLE_MODE(0 {:.4f})", c.css_max); }
  void operator()(const canon::SetSpindleSpeed& c) const { add(out, "SET_SPINDLE_SPEED(0, {:.4f})", c.rpm); }
  void operator()(const canon::StartSpindle& c) const {
    add(out, "START_SPINDLE_{}(0)", c.clockwise ? "CLOCKWISE" : "COUNTERCLOCKWISE");
  }
  void operator()(const canon::StopSpindle&) const { out += "STOP_SPINDLE_TURNING(0)"; }
  void operator()(const canon::OrientSpindle& c) const {
    add(out, "ORIENT_SPINDLE(0, {:.4f}, {})", c.deg, c.direction);
  }
  void operator()(const canon::WaitOrient& c) const {
    add(out, "SPINDLE.0.WAIT_ORIENT_COMPLETE({:.4f})", c.timeout_s);
  }
  void operator()(const canon::SelectTool& c) const { add(out, "SELECT_TOOL({})", c.tool); }
  void operator()(const canon::ChangeTool& c) const { add(out, "CHANGE_TOOL({})", c.slot); }
  void operator()(const canon::ChangeToolNumber& c) const { add(out, "CHANGE_TOOL_NUMBER({})", c.slot); }
  void operator()(const canon::SetToolTableEntry& c) const {
    const TableWords& v = c.offset;
    add(out,
        "SET_TOOL_TABLE_ENTRY({}, {}, {:.4f} {:.4f} {:.4f} {:.4f} {:.4f} {:.4f} 0.0000 0.0000 0.0000, "
        "{:.4f}, {:.4f}, {})",
        c.pocket, c.tool, v[0], v[1], v[2], v[3], v[4], v[5], c.front_deg, c.back_deg, c.orientation);
  }
  void operator()(const canon::StartFeedSync& c) const {
    add(out, "START_SPEED_FEED_SYNC({:.6f},{})", c.per_rev, c.velocity ? 1 : 0);
  }
  void operator()(const canon::SetOutputBit& c) const {
    add(out, "{}_{}_OUTPUT_BIT({})", c.on ? "SET" : "CLEAR", c.motion ? "MOTION" : "AUX", c.index);
  }
  void operator()(const canon::SetOutputValue& c) const {
    add(out, "SET_{}_OUTPUT_VALUE({},{:.6f})", c.motion ? "MOTION" : "AUX", c.index, c.value);
  }
  void operator()(const canon::WaitInput&) const {}
  void operator()(const canon::Message& c) const { add(out, "MESSAGE(\"{}\")", c.text); }
  void operator()(const canon::Comment& c) const { add(out, "COMMENT(\"{}\")", c.text); }
  void operator()(const canon::Print& c) const { out += c.text; }
  void operator()(const canon::Log& c) const {
    constexpr const char* kNames[] = {"LOG", "LOGOPEN", "LOGAPPEND"};
    if (c.what >= canon::Log::What::kProbeOpen) return;
    if (c.what == canon::Log::What::kClose)
      out += "LOGCLOSE()";
    else
      add(out, "{}(\"{}\")", kNames[static_cast<std::size_t>(c.what)], c.text);
  }
  void operator()(const canon::EnterArc& c) const { add(out, "ENTER_ARC({:.4f})", c.share); }
  void operator()(const canon::SetRtcp& c) const {
    add(out, "SET_TOOL_CENTRE_POINT_CONTROL({})", c.on ? "ON" : "OFF");
  }
  void operator()(const canon::SetTiltedPlane& c) const {
    if (!c.on) {
      out += "CANCEL_TILTED_PLANE()";
    } else if (c.aligned) {
      out += "ALIGN_TOOL_TO_PLANE()";
    } else {
      const Vec3 z = c.R.col(2);
      add(out, "SET_TILTED_PLANE({:.4f}, {:.4f}, {:.4f}, {:.4f}, {:.4f}, {:.4f})", c.origin.x(), c.origin.y(),
          c.origin.z(), z.x(), z.y(), z.z());
    }
  }
  void operator()(const canon::SetOrientationPath& c) const {
    add(out, "SET_ORIENTATION_PATH({})", c.great_circle ? "GREAT_CIRCLE" : "AXES");
  }
  void operator()(const canon::SetSpindleAxis& c) const {
    c.on ? add(out, "SET_SPINDLE_AXIS(ON, {:.4f})", c.deg) : add(out, "SET_SPINDLE_AXIS(OFF)");
  }
  void operator()(const canon::UserM& c) const {
    add(out, "USER_DEFINED_FUNCTION({}, {:.6f}, {:.6f})", c.code, c.p, c.q);
  }
};

constexpr std::size_t kFlushAt = 1U << 18;

}  // namespace

void CanonPrinter::print(const CanonCommand& command, std::string& out) { std::visit(Print{out}, command); }

void CanonPrinter::put(const CanonCommand& command, std::uint32_t) {
  if (stopped_) return;
  const std::size_t before = text_.size();
  print(command, text_);
  if (text_.size() != before) text_ += '\n';
  if (text_.size() > kFlushAt) flush();
}

void CanonPrinter::flush() {
  std::fwrite(text_.data(), 1, text_.size(), out_);
  std::fflush(out_);
  text_.clear();
}

}  // namespace trn

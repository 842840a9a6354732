#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/g_code.h"

// Canonical machining functions (NIST RS274/NGC, Kramer 2000, section 4) as plain structs. Coordinates are in
// the program's own system and units: lengths mm or inch as UseLengthUnits says, angles degrees.
namespace trn {

enum class Plane : std::uint8_t { kXY, kXZ, kYZ };
enum class MotionControl : std::uint8_t { kExactStop, kExactPath, kContinuous };

/// Canonical functions without arguments, in the order of their names' table (canon_printer.cc).
enum class PlainCanon : std::uint8_t {
  kOnReset,
  kFeedReferenceXyz,
  kMistOn,
  kMistOff,
  kFloodOn,
  kFloodOff,
  kStartChange,
  kEnableFeedOverride,
  kDisableFeedOverride,
  kEnableSpeedOverride,
  kDisableSpeedOverride,
  kEnableAdaptiveFeed,
  kDisableAdaptiveFeed,
  kEnableFeedHold,
  kDisableFeedHold,
  kTurnProbeOn,
  kTurnProbeOff,
  kStopFeedSync,
  kPalletShuttle,
  kProgramStop,
  kOptionalStop,
  kProgramEnd,
  kFinish  ///< the end of a program without M2 and M30
};

namespace canon {
struct Plain {
  PlainCanon what;
};
struct UseLengthUnits {
  bool inch;
};
struct SelectPlane {
  Plane plane;
};
struct SetG5xOffset {
  int index;
  ProgramWords offset;
};
struct SetG92Offset {
  ProgramWords offset;
};
struct SetXyRotation {
  double deg;
};
struct UseToolLengthOffset {
  ProgramWords offset;
};
struct SetFeedRate {
  double per_min;
};
/// mode 1: per revolution.
struct SetFeedMode {
  int mode;
};
/// orientation_deg is the axis tolerance beside the position tolerance, degrees; 0: the config's.
struct SetMotionControlMode {
  MotionControl mode;
  double tolerance;
  double orientation_deg;
};
struct SetNaivecamTolerance {
  double tolerance;
};
struct StraightTraverse {
  ProgramWords to;
};
/// inverse_per_min: G93's F word, 0 outside G93.
struct StraightFeed {
  ProgramWords to;
  double inverse_per_min = 0;
};
/// end1, end2 and centre in the active plane (XY; ZX; YZ), end3 along its normal; turns > 0 counterclockwise.
struct ArcFeed {
  ProgramWords to;
  double centre1, centre2;
  int turns;
  Plane plane;
  double inverse_per_min = 0;
};
/// The next function is an ArcFeed from `from`, of which this share was cut before; the machine stands at its
/// end.
struct EnterArc {
  ProgramWords from;
  double share;
};
/// The way up to the clear height behind the stop of G88. The operator may have gone some of it by hand; the
/// path goes on from its end.
struct ManualRetract {
  ProgramWords to;
};
/// code: G38.2 to G38.5.
struct StraightProbe {
  ProgramWords to;
  GCode code = 38.2_g;
};
struct RigidTap {
  ProgramWords to;
};
/// Polynomial pieces of a spline as cubic Bezier hulls (4 points each), in the XY plane; z and rotary
/// constant. control_points: how many the program gave, the start included.
struct NurbsFeed {
  int control_points;
  ProgramWords to;
  std::shared_ptr<const std::vector<Vec3>> bezier;
  bool spatial = false;  ///< the hulls have Z too
  double inverse_per_min = 0;
};
struct Dwell {
  double s;
};
struct SetSpindleMode {
  double css_max;
};
struct SetSpindleSpeed {
  double rpm;
};
struct StartSpindle {
  bool clockwise;
};
struct StopSpindle {};
struct OrientSpindle {
  double deg;
  int direction;
};
struct WaitOrient {
  double timeout_s;
};
struct SelectTool {
  int tool;
};
/// slot: the tool's place in the table, its number if the table does not have it; confirm: as in
/// QueueEvent::Kind::kToolChange.
struct ChangeTool {
  int tool, slot;
  int confirm = kToolByNobody;
};
struct ChangeToolNumber {
  int slot;
};
struct SetToolTableEntry {
  int pocket, tool;
  TableWords offset;
  double diameter, front_deg, back_deg;
  int orientation;
};
struct StartFeedSync {
  double per_rev;
  bool velocity;
  bool tap = false;  ///< a RigidTap follows
};
struct SetOutputBit {
  bool motion;
  bool on;
  int index;
};
struct SetOutputValue {
  bool motion;
  int index;
  double value;
};
struct WaitInput {
  int index;
  bool analog;
  int type;
  double timeout_s;
};
struct Message {
  std::string_view text;
};
struct Comment {
  std::string_view text;
};
struct Print {
  std::string_view text;
};
/// A comment of the LOG kind: what to do with the program's log file. `text` is a line of it, or its name.
/// And the same of the file that takes the contacts of probe moves, of which each tells its line.
struct Log {
  enum class What : std::uint8_t { kLine, kOpen, kAppend, kClose, kProbeOpen, kProbeClose, kProbePoint };
  What what = What::kLine;
  std::string text;
};
/// Tool-centre-point control on or off, at rest; `to` is where the machine then stands in program
/// coordinates.
struct SetRtcp {
  bool on;
  ProgramWords to;
};
/// Tilted work plane (G68.2): pose of the feature frame in the work offset's frame; `to` as in SetRtcp.
struct SetTiltedPlane {
  bool on;
  bool aligned;
  Vec3 origin;
  Mat3 R;
  ProgramWords to;
};
/// With RTCP on, straight feeds turn the tool axis on a great circle, or the rotary words evenly.
struct SetOrientationPath {
  bool great_circle;
};
/// At rest: the spindle's drive is an axis, which stands at `deg` then, clockwise; or a spindle again.
struct SetSpindleAxis {
  bool on;
  double deg = 0;
};
struct UserM {
  int code;
  double p, q;
};
}  // namespace canon

using CanonCommand = std::variant<
    canon::Plain, canon::UseLengthUnits, canon::SelectPlane, canon::SetG5xOffset, canon::SetG92Offset,
    canon::SetXyRotation, canon::UseToolLengthOffset, canon::SetFeedRate, canon::SetFeedMode,
    canon::SetMotionControlMode, canon::SetNaivecamTolerance, canon::StraightTraverse, canon::StraightFeed,
    canon::ArcFeed, canon::EnterArc, canon::ManualRetract, canon::StraightProbe, canon::RigidTap,
    canon::NurbsFeed, canon::Dwell, canon::SetSpindleMode, canon::SetSpindleSpeed, canon::StartSpindle,
    canon::StopSpindle, canon::OrientSpindle, canon::WaitOrient, canon::SelectTool, canon::ChangeTool,
    canon::ChangeToolNumber, canon::SetToolTableEntry, canon::StartFeedSync, canon::SetOutputBit,
    canon::SetOutputValue, canon::WaitInput, canon::Message, canon::Comment, canon::Print, canon::Log,
    canon::SetRtcp, canon::SetTiltedPlane, canon::SetOrientationPath, canon::SetSpindleAxis, canon::UserM>;

/// Receives the canonical functions in program order; `line` is 1-based, 0 before the program. Text is only
/// valid during the call.
class CanonSink {
 public:
  virtual ~CanonSink() = default;
  virtual void put(const CanonCommand& command, std::uint32_t line) = 0;
};

}  // namespace trn

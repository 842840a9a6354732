#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "core/frames.h"
#include "core/path.h"

namespace trn {

/// The corrections inside the plan, as bits; the bits above them number those behind it
/// (app/session/corrections.cc).
inline constexpr std::uint8_t kGeometricBit = 1, kJointTableBit = 2;
inline constexpr std::uint8_t kPlannedBits = kGeometricBit | kJointTableBit;

/// What a path piece means to the joints: constant along a piece, never changes inside a stretch.
struct MapContext {
  bool rtcp = false;                 ///< y is the tip in B (on) or the machine's own axes (off)
  Vec3 tool_offset = Vec3::Zero();   ///< gauge point to tip, (0, 0, L) for a plain tool length L, mm
  Pose X_WB;                         ///< table in work frame, for reports of the tip in W
  std::uint8_t corrections_off = 0;  ///< of kPlannedBits: these do not act

  bool operator==(const MapContext& other) const TRN_RT {
    return rtcp == other.rtcp && tool_offset == other.tool_offset && X_WB.R == other.X_WB.R &&
           X_WB.p == other.X_WB.p && corrections_off == other.corrections_off;
  }
};

/// A stretch of constant jerk of the path parameter: s(t) = s + v t + a t^2/2 + j t^3/6, t in [0, duration].
struct TimeSegment {
  double duration_s = 0;
  double s = 0, v = 0, a = 0, j = 0;

  double s_at(double t) const TRN_RT { return s + t * (v + t * (a / 2 + t * (j / 6))); }
  double v_at(double t) const TRN_RT { return v + t * (a + t * (j / 2)); }
  double a_at(double t) const TRN_RT { return a + t * j; }
};

/// How the motor joints move during a segment, by plan time, each over the joint's own jerk limit: velocity
/// (s^2) and acceleration (s) where the segment begins, acceleration where it ends, and the least and
/// greatest jerk in between (1). Between the ends the acceleration counts as linear and the velocity as its
/// integral.
struct JointMotion {
  std::array<float, kMaxJoints> v{}, a{}, a_end{}, j_min{}, j_max{};
};

/// What the program leaves to the operator (M48 to M53).
struct OverrideMode {
  bool feed = true, spindle = true;  ///< their overrides act; off: 100 %
  bool adaptive = false;             ///< the adaptive feed acts
  bool feed_hold = true;             ///< a hold acts at once; off: where it is allowed again
  bool per_turn = false;             ///< F is in mm a turn (G95)

  /// The feed follows the override of the spindle, too, so that the chip keeps its thickness.
  bool follows_spindle() const TRN_RT { return per_turn && spindle; }

  bool operator==(const OverrideMode&) const = default;
};

/// Constant surface speed (G96): the nearer the tip is to the axis that the work turns about, the faster the
/// spindle turns.
struct SurfaceSpeed {
  Vec3 across =
      Vec3::UnitX();   ///< unit vector from that axis to the tip: the program's X, in the words' frame
  double axis_mm = 0;  ///< where the axis lies along it: the program's X0
  double rpm_mm = 0;   ///< rpm times the distance from the axis, + clockwise; 0: S is the speed
  double rpm_max = 0;  ///< at most this fast

  bool acts() const TRN_RT { return rpm_mm != 0; }
  /// The speed for a tip there, in the words' frame; mm -> rpm, + clockwise.
  double rpm_at(const Vec3& tip) const TRN_RT {
    const double mm = std::abs(across.dot(tip) - axis_mm);
    if (!acts() || std::abs(rpm_mm) < rpm_max * mm) return rpm_mm / (acts() ? mm : 1);
    return std::copysign(rpm_max, rpm_mm);
  }
};

/// Who tells that the tool of a kToolChange is in: the rise of an input, by its number, or one of these.
inline constexpr int kToolByNobody = -2, kToolByOperator = -1;

/// Something that happens between motions, with the machine at rest, in program order.
struct QueueEvent {
  enum class Kind : std::uint8_t {
    kNone,
    kDwell,
    kSpindle,
    kCoolant,
    kToolChange,  ///< may wait until the tool is in; then the program's planning waits for that
    kMessage,
    kOptionalStop,
    kProgramStop,
    kProgramEnd,
    kUser,
    kCorrection,
    kSpindleOrient,  ///< waits until the spindle stands there
    kDigitalOutput,
    kAnalogOutput,
    kWaitInput,    ///< waits for an input; the program's planning waits for its value
    kProbeStart,   ///< the motion up to kProbeEnd ends where the probe changes
    kProbeEnd,     ///< the program's planning waits for where that was
    kGearStart,    ///< spindle and path run geared up to kGearEnd
    kGearReverse,  ///< kPathLeads: the path goes back when the spindle stands where it belongs
    kGearEnd
  };
  Kind kind = Kind::kNone;
  /// Dwell: s; spindle: rpm, signed (+ clockwise); orient: degrees; output: its value; wait: time limit, s;
  /// gear: the turns a second that the plan was made for, signed with kPathLeads; user: P; corrections: 1 on,
  /// 0 off; tool change: who confirms it (kToolByOperator).
  double value = 0;
  /// Tool number; coolant bits (1 mist, 2 flood); message number; user M-code; number of the output; input
  /// (input_argument); ProbeMode; GearMode; corrections; program end: 1 switches the coolant off.
  std::int32_t argument = 0;
  OverrideMode overrides = {};  ///< in force when it happens
  double per_turn_mm = 0;       ///< gear: tip path of a turn
  SurfaceSpeed surface = {};    ///< spindle: from here on by where the tip is, `value` being the speed here
};

/// What M66 waits for. kNow: nothing, the value is taken as it is.
enum class InputWait : std::uint8_t { kNow, kRise, kFall, kHigh, kLow };

/// G38.2 to G38.5: until contact or until it is lost; failing is a fault or not.
enum class ProbeMode : std::uint8_t { kContact = 2, kTryContact, kRelease, kTryRelease };

/// Which of the two leads while spindle and path are geared.
enum class GearMode : std::uint8_t { kSpindleLeads, kPathLeads };

/// kWaitInput's argument: number of the input, what to wait for, and whether it is an analog one.
struct InputArgument {
  int index = 0;
  InputWait wait = InputWait::kNow;
  bool analog = false;

  std::int32_t packed() const { return index | static_cast<int>(wait) << 8 | (analog ? 1 << 16 : 0); }
  static InputArgument unpack(std::int32_t argument) TRN_RT {
    return {argument & 0xFF, static_cast<InputWait>(argument >> 8 & 0xFF), (argument >> 16 & 1) != 0};
  }
};

/// Outputs that change where a motion begins, without a stop (M62, M63, M67).
struct OutputChanges {
  static constexpr int kAnalogMax = 4;
  struct Analog {
    std::uint8_t index = 0;
    double value = 0;
  };
  std::uint64_t set = 0, clear = 0;  ///< bit i: digital output i
  std::array<Analog, kAnalogMax> analog{};
  std::uint8_t analog_count = 0;

  bool any() const TRN_RT { return (set | clear) != 0 || analog_count != 0; }
  void put(int index, bool on) TRN_RT {
    const std::uint64_t bit = std::uint64_t{1} << index;
    set = on ? set | bit : set & ~bit;
    clear = on ? clear & ~bit : clear | bit;
  }
  /// False if there is no room for one more analog output.
  bool put(int index, double value) TRN_RT {
    int i = 0;
    while (i < analog_count && analog[static_cast<std::size_t>(i)].index != index) ++i;
    if (i == kAnalogMax) return false;
    if (i == analog_count) ++analog_count;
    analog[static_cast<std::size_t>(i)] = {static_cast<std::uint8_t>(index), value};
    return true;
  }
  /// These, then `later` ones.
  void add(const OutputChanges& later) TRN_RT {
    set = (set & ~later.clear) | later.set;
    clear = (clear & ~later.set) | later.clear;
    for (int i = 0; i < later.analog_count; ++i) {
      const Analog& a = later.analog[static_cast<std::size_t>(i)];
      put(a.index, a.value);
    }
  }
};

/// What a motion or an event was made for.
struct SourceLine {
  std::uint32_t line = 0;  ///< of the program's text, 1-based; a loop comes to it many times
  std::uint32_t step = 0;  ///< counts the moves and events of a program from 1; 0: none
};

/// One item of the ring between planner and interpolator: a path piece with the time law over (part of) it,
/// or an event. Plain data. Time segments follow each other without gap; s is local to the piece.
struct MotionBlock {
  static constexpr int kMaxSegments = 8;

  PathPiece piece;
  MapContext context;
  std::array<TimeSegment, kMaxSegments> segments;
  std::array<JointMotion, kMaxSegments> joints;  ///< of each segment
  std::uint8_t segment_count = 0;                ///< 0: an event
  bool ends_at_rest = false;                     ///< the last segment ends with v = a = 0
  bool rapid = false;                            ///< G0: feed override does not act, rapid override does
  OverrideMode overrides;
  SourceLine source;
  QueueEvent event;
  OutputChanges outputs;  ///< act where the block begins
};

}  // namespace trn

#pragma once

#include <array>
#include <cstdint>

#include "core/frames.h"
#include "core/path.h"

namespace trn {

/// What a path piece means to the joints: constant along a piece, never changes inside a stretch.
struct MapContext {
  bool rtcp = false;                ///< y is the tip in B (on) or the machine's own axes (off)
  Vec3 tool_offset = Vec3::Zero();  ///< gauge point to tip, (0, 0, L) for a plain tool length L, mm
  Pose X_WB;                        ///< table in work frame, for reports of the tip in W

  bool operator==(const MapContext& other) const TRN_RT {
    return rtcp == other.rtcp && tool_offset == other.tool_offset && X_WB.R == other.X_WB.R &&
           X_WB.p == other.X_WB.p;
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

/// Something that happens between motions, with the machine at rest, in program order.
struct QueueEvent {
  enum class Kind : std::uint8_t {
    kNone,
    kDwell,
    kSpindle,
    kCoolant,
    kToolChange,
    kMessage,
    kOptionalStop,
    kProgramStop,
    kProgramEnd,
    kUser
  };
  Kind kind = Kind::kNone;
  double value = 0;           ///< dwell: s; spindle: rpm, signed (+ clockwise)
  std::int32_t argument = 0;  ///< tool number; coolant bits (1 mist, 2 flood); message number; user M-code
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
  std::uint32_t line = 0;                        ///< source line, 1-based
  QueueEvent event;
};

}  // namespace trn

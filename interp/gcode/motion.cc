#include <cmath>

#include "interp/gcode/error.h"
#include "interp/gcode/executor.h"

namespace trn {

namespace {

constexpr double kLeastInverseRate = 0.1;

double linear_length(const AxisValues& from, const AxisValues& to) {
  const AxisValues d = to - from;
  const double linear = d.head<3>().norm();
  return linear > 0 ? linear : d.tail<3>().norm();
}

}  // namespace

double Executor::wrapped(double to, double from) const { return from + std::remainder(to - from, 360.0); }

// Where the axis words of the block point to, in program coordinates.
AxisValues Executor::target(const Block& b) const {
  if (b.code(GGroup::kNonModal) == 530) return machine_target(b);
  AxisValues to = s_.position;
  if (!b.has_axis_word()) return to;
  for (int i = 0; i < 6; ++i) {
    const char letter = kWordLetters[i];
    if (!b.has(letter)) continue;
    double value = b[letter];
    if (i == kX && s_.modal.diameter) value /= 2;
    if (s_.modal.incremental)
      to[i] += value;
    else
      to[i] = parts_.config.wrapped_mask >> i & 1U ? wrapped(value, to[i]) : value;
  }
  return to;
}

// G53: the words are the machine's own coordinates.
AxisValues Executor::machine_target(const Block& b) const {
  AxisValues machine = frame().to_machine(to_mm(s_.position)) + to_mm(s_.tool_offset);
  for (int i = 0; i < 6; ++i)
    if (b.has(kWordLetters[i])) machine[i] = i < 3 ? to_mm(b[kWordLetters[i]]) : b[kWordLetters[i]];
  return from_mm(frame().to_program(machine - to_mm(s_.tool_offset)));
}

void Executor::check_feed(const Block& b, std::string_view what) const {
  const std::uint32_t column = b.at(GGroup::kMotion);
  const std::uint32_t at = b.code(GGroup::kMotion) >= 0 ? column : 1;
  switch (s_.modal.feed_mode) {
    case FeedMode::kInverseTime:
      if (!b.has('F') || b['F'] == 0) fail(GcodeErrorCode::kInverseFeedMissing, at, what);
      break;
    case FeedMode::kPerRevolution:
      if (s_.modal.speed == 0) fail(GcodeErrorCode::kNoSpindle, at, "G95");
      [[fallthrough]];
    default:
      if (s_.modal.feed == 0) fail(GcodeErrorCode::kZeroFeed, at, what);
  }
}

double Executor::inverse_rate(const Block& b) const {
  return s_.modal.feed_mode == FeedMode::kInverseTime ? b.get('F', s_.modal.feed) : 0.0;
}

// In G93 the rate in units per minute follows from the length of the move.
void Executor::set_motion_limits(double length, const Block& b) {
  if (s_.modal.feed_mode == FeedMode::kInverseTime)
    put(canon::SetFeedRate{std::max(kLeastInverseRate, length * b['F'])});
}

void Executor::straight(const Block& b, int motion) {
  if (motion == 10) check_feed(b, "G1");
  if (b.code(GGroup::kNonModal) == 530) {
    if (comp_.active()) fail(GcodeErrorCode::kCompState, b.at(GGroup::kNonModal), "G53");
    if (s_.tilted)
      fail(GcodeErrorCode::kTiltedPlane, b.at(GGroup::kNonModal), "G53 in a tilted plane", "G69 first");
    if (s_.rtcp) return suspend_rtcp(b, [&] { put_straight(b, target(b), motion == 0); });
  }
  AxisValues to = target(b);
  if (s_.tool_vector && (b.has('I') || b.has('J') || b.has('K'))) to = vector_target(b, to);
  put_straight(b, to, motion == 0);
}

void Executor::put_straight(const Block& b, const AxisValues& to, bool traverse) {
  if (!traverse && s_.modal.feed_mode == FeedMode::kInverseTime)
    set_motion_limits(linear_length(s_.position, to), b);
  if (comp_.active()) {
    comp_move(b, traverse ? CanonCommand(canon::StraightTraverse{to})
                          : CanonCommand(canon::StraightFeed{to, inverse_rate(b)}));
  } else if (traverse) {
    put(canon::StraightTraverse{to});
  } else {
    put(canon::StraightFeed{to, inverse_rate(b)});
  }
  left_contour_ = false;
  s_.position = to;
}

void Executor::probe(const Block& b, int motion) {
  const std::uint32_t column = b.at(GGroup::kMotion);
  if (comp_.active()) fail(GcodeErrorCode::kCompState, column, g_name(motion));
  check_feed(b, g_name(motion));
  if (s_.modal.feed_mode == FeedMode::kInverseTime)
    fail(GcodeErrorCode::kFeedModeCycle, column, g_name(motion), "G93");
  const AxisValues to = target(b);
  if ((to - s_.position).tail<3>().cwiseAbs().maxCoeff() > 0)
    fail(GcodeErrorCode::kProbe, column, "turns a rotary axis");
  if ((to - s_.position).norm() < from_mm(0.254))
    fail(GcodeErrorCode::kProbe, column, "ends where it starts");
  put(PlainCanon::kTurnProbeOn);
  put(canon::StraightProbe{to});
  put(PlainCanon::kTurnProbeOff);
  s_.position = to;
  const AxisValues mm = to_mm(to);
  for (int i = 0; i < 6; ++i) parts_.parameters[parameter::kProbe + i] = mm[i];
}

// G33 and G33.1: a straight move geared to the spindle, K units a turn.
void Executor::spindle_synchronous(const Block& b, int motion) {
  const std::uint32_t column = b.at(GGroup::kMotion);
  if (comp_.active()) fail(GcodeErrorCode::kCompState, column, g_name(motion));
  if (s_.modal.turn == SpindleTurn::kStopped || s_.modal.speed == 0)
    fail(GcodeErrorCode::kNoSpindle, column, g_name(motion));
  const AxisValues to = target(b);
  put(canon::StartFeedSync{b['K'], false});
  if (motion == 330) {
    put(canon::StraightFeed{to, 0});
    s_.position = to;
  } else {
    put(canon::RigidTap{to});
  }
  put(PlainCanon::kStopFeedSync);
}

}  // namespace trn

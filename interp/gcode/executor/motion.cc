#include <fmt/format.h>

#include <cmath>

#include "core/frames.h"
#include "core/units.h"
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

constexpr double kLeastInverseRate = 0.1;
constexpr double kNoTurn_deg = 1e-9;  // less is rounding, no turn of 360 degrees
constexpr double kProbeBackoff_mm = 0.254;

double linear_length(const ProgramWords& from, const ProgramWords& to) {
  const ProgramWords d = to - from;
  const double linear = d.xyz.norm();
  // RS274/NGC: the way of X, Y and Z counts, and that of the rotary axes only where nothing
  // else moves. Its unit is then the degree.
  return linear > 0 ? linear : d.abc_deg.norm();
}

}  // namespace

// The short way, or as LinuxCNC has it: the angle is the word without its sign, and the sign is the way
// round. -0 is a word with a sign. An angle where the axis stands already is no motion.
double Executor::wrapped(double to, double from) const {
  const double angle = parts_.config.wrapped_by_sign ? std::abs(to) : to;
  const double way = std::remainder(angle - from, 360.0);
  if (!parts_.config.wrapped_by_sign || std::abs(way) < kNoTurn_deg) return from + way;
  if (std::signbit(to)) return from + (way > 0 ? way - 360 : way);
  return from + (way < 0 ? way + 360 : way);
}

double Executor::wrapped_word(const Block& b, char letter, double from) const {
  const double value = b[letter];
  if (parts_.config.wrapped_by_sign && std::abs(value) >= 360)
    fail(GcodeErrorCode::kBadValue, b.at(letter), letter, value, "a wrapped axis",
         "an angle below 360, whose sign is the way round");
  return wrapped(value, from);
}

// Where the axis words of the block point to, in program coordinates.
ProgramWords Executor::target(const Block& b) const {
  if (b.code(GGroup::kNonModal) == 53_g) return machine_target(b);
  ProgramWords to = s_.position;
  if (!b.has_axis_word()) return to;
  if (b.has_polar()) polar(b, to[kX], to[kY]);
  for (int i = 0; i < 6; ++i) {
    const char letter = kWordLetters[i];
    if (!b.has(letter)) continue;
    const double value = b[letter];
    // In G90 a wrapped axis goes the short way: from 350 to 10 degrees is 20 on, not 340 back. In G91 the
    // word is the way itself.
    if (s_.modal.incremental)
      to[i] += value;
    else
      to[i] = parts_.config.wrapped_mask >> i & 1U ? wrapped_word(b, letter, to[i]) : value;
  }
  return to;
}

// @ and ^: distance of (x, y) from the origin and angle; what is not given stays as it is.
void Executor::polar(const Block& b, double& x, double& y) const {
  const std::uint32_t column = b.at(b.has(kPolarRadius) ? kPolarRadius : kPolarAngle);
  for (const char letter : {'X', 'Y'})
    if (b.has(letter)) fail(GcodeErrorCode::kPolar, b.at(letter), fmt::format("goes with a word {}", letter));
  double radius = std::hypot(x, y);
  double angle_deg = kDegPerRad * std::atan2(y, x);
  if (radius == 0 && !b.has(kPolarAngle))
    fail(GcodeErrorCode::kPolar, column, "stands at the origin without ^");
  const bool more = s_.modal.incremental;
  // The angle of the origin is whatever atan2 says of it; a step from there would lead somewhere by chance.
  if (radius == 0 && more) fail(GcodeErrorCode::kPolar, column, "stands at the origin in G91");
  if (b.has(kPolarRadius)) radius = b[kPolarRadius] + (more ? radius : 0);
  if (b.has(kPolarAngle)) angle_deg = b[kPolarAngle] + (more ? angle_deg : 0);
  x = radius * std::cos(rad_from_deg(angle_deg));
  y = radius * std::sin(rad_from_deg(angle_deg));
}

// Arcs and cycles in the other planes have no XY to which the words could belong.
void Executor::check_polar_plane(const Block& b) const {
  if (s_.modal.plane != Plane::kXY)
    fail(GcodeErrorCode::kPolar, b.at(b.has(kPolarRadius) ? kPolarRadius : kPolarAngle),
         "goes with arcs and cycles in G17 only");
}

// G53: the words are the machine's own coordinates.
ProgramWords Executor::machine_target(const Block& b) const {
  // G53 means the place of the spindle with its tool, so the offset is added before a word is replaced and
  // taken off again behind.
  MachineWords machine = frame().to_machine(to_mm(s_.position)) + to_mm(in_words(s_.tool_offset));
  for (int i = 0; i < 6; ++i) {
    const char letter = kWordLetters[i];
    if (!b.has(letter)) continue;
    // Where the sign is the way round, as LinuxCNC has it, that holds here, too.
    const bool signed_way = parts_.config.wrapped_by_sign && (parts_.config.wrapped_mask >> i & 1U) != 0;
    machine[i] = i < 3 ? to_mm(b[letter]) : signed_way ? wrapped_word(b, letter, machine[i]) : b[letter];
  }
  return from_mm(frame().to_program(machine - to_mm(in_words(s_.tool_offset))));
}

void Executor::check_feed(const Block& b, std::string_view what) const {
  const std::uint32_t at = b.motion_column();
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

void Executor::straight(const Block& b, GCode motion) {
  if (motion == 1_g) check_feed(b, "G1");
  if (b.code(GGroup::kNonModal) == 53_g) {
    if (comp_.active()) fail(GcodeErrorCode::kCompState, b.at(GGroup::kNonModal), "G53");
    if (s_.tilted)
      fail(GcodeErrorCode::kTiltedPlane, b.at(GGroup::kNonModal), "G53 in a tilted plane", "G69 first");
    // With RTCP on the words are a tip in the work. Machine coordinates are those of the axes, so it is off
    // for this move.
    if (s_.rtcp) return suspend_rtcp(b, [&] { put_straight(b, target(b), motion == 0_g); });
  }
  ProgramWords to = target(b);
  if (s_.tool_vector && (b.has('I') || b.has('J') || b.has('K'))) to = vector_target(b, to);
  put_straight(b, to, motion == 0_g);
}

void Executor::put_straight(const Block& b, const ProgramWords& to, bool traverse) {
  // In G93 the time of the block is given, so the speed follows from its length and must be set before the
  // move.
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

void Executor::probe(const Block& b, GCode motion) {
  const std::uint32_t column = b.at(GGroup::kMotion);
  if (comp_.active()) fail(GcodeErrorCode::kCompState, column, g_name(motion));
  check_feed(b, g_name(motion));
  if (s_.modal.feed_mode != FeedMode::kPerMinute)
    fail(GcodeErrorCode::kFeedModeCycle, column, g_name(motion),
         s_.modal.feed_mode == FeedMode::kInverseTime ? "G93" : "G95");
  const ProgramWords to = target(b);
  if (to == s_.position) fail(GcodeErrorCode::kProbe, column, "ends where it starts");
  put(PlainCanon::kTurnProbeOn);
  put(canon::StraightProbe{to, motion});
  put(PlainCanon::kTurnProbeOff);
  // With a machine the answer comes later, and the lines behind wait for it. Without one the end of the move
  // is taken for the contact.
  if (parts_.asks)
    questions_.push_back(Question::kProbe);
  else
    probed({0, to, short_of(to)});
}

// Where the stand-alone interpreters let a probe move stop that nobody answers: a hundredth of an inch
// (0.254 mm) before its end.
ProgramWords Executor::short_of(const ProgramWords& to) const {
  const Vec3 way = (to - s_.position).xyz;
  ProgramWords stands = to;
  if (way.norm() > 0) stands.xyz -= from_mm(kProbeBackoff_mm) * way.normalized();
  return stands;
}

void Executor::probed(const MachineAnswer& answer) {
  s_.position = answer.stands;
  for (int i = 0; i < 6; ++i) parts_.parameters[parameter::kProbe + i] = answer.contact[i];
  parts_.parameters[parameter::kProbeSuccess] = answer.value;
  if (answer.value == 0) return;
  // Nine numbers, as other controls write them: X Y Z A B C, and U V W, which no machine here has.
  const ProgramWords& at = answer.contact;
  put_now(canon::Log{canon::Log::What::kProbePoint,
                     fmt::format("{:.6f} {:.6f} {:.6f} {:.6f} {:.6f} {:.6f} {:.6f} {:.6f} {:.6f}", at[0],
                                 at[1], at[2], at[3], at[4], at[5], 0.0, 0.0, 0.0)});
}

void Executor::answer(const MachineAnswer& answer) {
  const Question question = questions_.front();
  questions_.erase(questions_.begin());
  if (question == Question::kProbe) return probed(answer);
  if (question == Question::kTool) return tool_is_in(incoming_tool_);
  parts_.parameters[parameter::kInputResult] = answer.value;
}

}  // namespace trn

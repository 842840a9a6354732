#include "interp/gcode/lowering.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/check.h"
#include "core/path.h"
#include "core/units.h"
#include "interp/gcode/cutter/plane_curve.h"
#include "interp/gcode/error.h"
#include "interp/gcode/modal.h"
#include "interp/gcode/spline_chords.h"
#include "interp/gcode/surface_parts.h"

namespace trn {

namespace {

constexpr double kSecondsPerMinute = 60.0;
constexpr double kGearReserve = 1.1;     // a thread is planned for a spindle that much faster than told
constexpr double kTapShare = 0.8;        // of the spindle's acceleration that the path of a tap takes
constexpr double kAxisChord_rad = 5e-5;  // tool axis of a chord from its great circle
constexpr int kAxisChordsMax = 512;
constexpr double kSameWords_rad = 1e-4;
constexpr double kTipAtRest = 1e-9;  // mm; F then means the rotary words
constexpr double kMmPerMetre = 1000, kInchPerFoot = 12;

// Unit vector a share t of the angle between a and b from a.
Vec3 slerp(const Vec3& a, const Vec3& b, double t) {
  // Exact for small angles, where the arc cosine has lost half of its digits.
  const double angle = std::atan2(a.cross(b).norm(), a.dot(b));
  return (std::sin((1 - t) * angle) * a + std::sin(t * angle) * b) / std::sin(angle);
}

double length_of(Words from, const std::vector<Words>& way) {
  double length = 0;
  for (const Words& to : way) {
    length += path_norm(to - from);
    from = to;
  }
  return length;
}

}  // namespace

MmWords ProgramFrame::mm_of(const Words& words) const {
  MmWords p = in_degrees<MmWords>(words);
  // Without a turn the coordinates differ by a shift, which loses no digits.
  p.xyz = X_TP.R.isIdentity(0) ? Vec3(p.xyz - X_TP.p) : inverse(X_TP) * p.xyz;
  p.abc_deg -= abc_deg;
  return p;
}

Lowering::Lowering(const ProgramConfig& config, const Kinematics* kinematics, MoveSink& sink,
                   const Words& start, std::uint8_t corrections_off)
    : config_(config), kinematics_(kinematics), sink_(sink), words_(start) {
  move_.mode = config.path_mode == MotionControl::kExactStop   ? PathMode::kExactStop
               : config.path_mode == MotionControl::kExactPath ? PathMode::kExactPath
                                                               : PathMode::kContinuous;
  great_circle_ = config.great_circle;
  move_.tolerance_mm = config.tolerance_mm;
  move_.tolerance_rad = rad_from_deg(config.tolerance_deg);
  move_.context.corrections_off = corrections_off;
  set_frame();
}

// As far as the words without RTCP go less far for the tool: along the spindle at home.
MmWords Lowering::in_words(MmWords tool) const {
  if (kinematics_) tool.xyz = kinematics_->tool_in_words(tool.xyz);
  return tool;
}

Words Lowering::words_of(const ProgramWords& program) const {
  MmWords p = in_mm(program, inch_);
  p.xyz = plain_ ? Vec3(p.xyz + X_TP_.p) : X_TP_ * p.xyz;
  // Rotary words have no frame: offsets are added to them, and a rotation about Z or a tilted plane does not
  // turn them.
  p.abc_deg += offset_abc_deg();
  return in_radians(p);
}

void Lowering::set_frame() {
  X_TP_ = frame_.X_MP();
  if (tip_in_table() && kinematics_) X_TP_ = kinematics_->home_X_BM() * X_TP_;
  // Without any turn the frame is a shift, which every word of a long program then costs one addition.
  plain_ = X_TP_.R.isIdentity(0);
  move_.context.rtcp = tip_in_table();
  move_.context.tool_offset = tool_.xyz;
  spindle_due_ |= rpm_max_ > 0 && turning_;  // G96 has its axis elsewhere now
  // reports of the tip are in program coordinates: W is the program frame
  const Pose X_MP = frame_.X_MP();
  const Pose X_BM = kinematics_ ? kinematics_->home_X_BM() : Pose{};
  move_.context.X_WB = inverse(X_BM * X_MP);
}

// The machine stands still, but is described anew: RTCP, tool or plane changed. `program` is the same place.
void Lowering::moved_frame(const ProgramWords& program) {
  set_frame();
  const Vec3 abc = words_.tail<3>();
  words_ = words_of(program);
  words_.tail<3>() = abc;
}

// By G96 the distance counts from the program's X0, where the work turns, to the tip.
SurfaceSpeed Lowering::surface_speed() const {
  SurfaceSpeed law;
  law.across = X_TP_.R.col(0);
  law.axis_mm = law.across.dot(X_TP_.p);
  law.rpm_mm = (clockwise_ ? speed_ : -speed_) * speed_unit_mm_ / (2 * kPi);
  law.rpm_max = std::min({rpm_max_, config_.spindle_rpm_max, config_.spindle_axis.rpm_max});
  return law;
}

// + clockwise.
double Lowering::rpm_here() const {
  if (rpm_max_ > 0) return surface_speed().rpm_at(words_.head<3>());
  return clockwise_ ? speed_ : -speed_;
}

void Lowering::tell_spindle() {
  spindle_due_ = false;
  spindle_told_ = true;
  QueueEvent event{QueueEvent::Kind::kSpindle, turning_ ? rpm_here() : 0, 0, overrides_};
  if (turning_ && rpm_max_ > 0) event.surface = surface_speed();
  ++move_.source.step;
  sink_.event(event, move_.source);
}

// The spindle's speed for the feed a turn of a straight part from here: half-way, which is within half a step
// of either end. Where the move is not parted, the slower end, so that no chip is thicker than programmed.
double Lowering::rpm_for(const Words& to) const {
  if (rpm_max_ <= 0) return speed_;
  const SurfaceSpeed law = surface_speed();
  if (parts_by_speed()) return std::abs(law.rpm_at((words_ + to).head<3>() / 2));
  return std::min(std::abs(law.rpm_at(words_.head<3>())), std::abs(law.rpm_at(to.head<3>())));
}

void Lowering::limit_feed(double rpm) {
  FeedLimit& limit = move_.feed;
  limit = FeedLimit{};
  // In G33 the spindle gives the speed. The plan is made for the commanded speed and a reserve, and the tick
  // drives it at the rate at which the spindle really turns.
  const double per_min = geared_           ? kGearReserve * per_turn_ * gear_rpm_
                         : per_revolution_ ? feed_ * rpm
                                           : feed_;
  limit.tip_mm_s = (inch_ ? per_min * kMmPerInch : per_min) / kSecondsPerMinute;
  // F of a move in which nothing but rotary axes turns is in degrees a minute.
  limit.rotary_rad_s = per_min * kRadPerDeg / kSecondsPerMinute;
}

void Lowering::send(const Words& to) {
  // The tip may have come from far away: the cut waits until the spindle has the speed for this place.
  const bool enters = move_.kind != ProgramMove::Kind::kTraverse && std::exchange(traversed_, false);
  traversed_ = move_.kind == ProgramMove::Kind::kTraverse;
  if (!geared_ && (spindle_due_ || (enters && rpm_max_ > 0 && turning_))) tell_spindle();
  move_.from = words_;
  move_.to = to;
  words_ = to;
  move_.feed.overrides = overrides_;
  move_.feed.overrides.per_turn = per_revolution_ && !geared_;
  ++move_.source.step;
  sink_.move(move_);
  move_.outputs = {};
  move_.duration_s = 0;
}

// Straight parts of one block. Each has the share of the block's time that it has of the way.
void Lowering::send(const std::vector<Words>& way, double inverse_per_min) {
  const double length = length_of(words_, way);
  const bool by_place = rpm_max_ > 0 && per_revolution_ && !geared_ && std::isfinite(move_.feed.tip_mm_s);
  const double rotary = move_.feed.rotary_rad_s;
  for (const Words& next : way) {
    if (by_place) limit_feed(rpm_for(next));
    move_.feed.rotary_rad_s = rotary;
    const double part = path_norm(next - words_);
    if (inverse_per_min > 0) move_.duration_s = kSecondsPerMinute / inverse_per_min * part / length;
    send(next);
  }
}

void Lowering::straight(const ProgramWords& to, ProgramMove::Kind kind, double inverse_per_min) {
  const Words words = words_of(to);
  // A move to where the machine stands is none; it would only be a stop between its neighbours.
  if (words == words_) return;
  move_.kind = kind;
  const bool tip_rests = (words - words_).head<3>().norm() <= kTipAtRest;
  std::vector<Words> way;
  if (kind == ProgramMove::Kind::kFeed) way = great_circle(words);
  const bool fed = kind == ProgramMove::Kind::kFeed && inverse_per_min == 0;
  if (way.empty()) way = fed ? line_parts(words) : std::vector<Words>{words};
  move_.feed = FeedLimit{};
  if (fed) limit_feed(rpm_for(words));
  // Where the tip moves F is the tip's, and the rotary axes go along.
  if (!tip_rests) move_.feed.rotary_rad_s = FeedLimit::kNone;
  send(way, inverse_per_min);
}

// The feed a turn follows the speed of G96 along a move, in parts. Where the end of a part would be a stop it
// does not.
bool Lowering::parts_by_speed() const {
  return rpm_max_ > 0 && per_revolution_ && !geared_ && move_.mode != PathMode::kExactStop;
}

// Ends of straight parts along which the speed of G96 changes by a step.
std::vector<Words> Lowering::line_parts(const Words& to) const {
  std::vector<Words> way;
  if (parts_by_speed())
    for (const double share : speed_steps(surface_speed(), words_, to))
      way.emplace_back(words_ + share * (to - words_));
  way.push_back(to);
  return way;
}

// Places on the great circle to `to`, it being the last, as many as its chords ask for. None where the words
// go evenly: where they are told to, where one chord will do, where a chord's end would be a stop, and where
// the words of the great circle do not lead to the programmed ones (through a pole, or more than half a turn
// of a table).
std::vector<Words> Lowering::great_circle(const Words& to) const {
  std::vector<Words> way;
  if (!great_circle_ || !rtcp_ || !kinematics_ || move_.mode != PathMode::kContinuous) return way;
  if ((to - words_).tail<3>().norm() < kSameWords_rad) return way;
  bool found = false;
  for (int parts = 1; parts <= kAxisChordsMax && !found; parts *= 2) found = on_great_circle(to, parts, way);
  if (!found || way.size() == 1) way.clear();
  return way;
}

bool Lowering::on_great_circle(const Words& to, int parts, std::vector<Words>& way) const {
  TRN_CHECK(kinematics_ != nullptr);
  TRN_CHECK(parts >= 1 && parts <= kAxisChordsMax);
  const auto axis = [&](const Vec3& abc) { return Vec3(kinematics_->orientation(abc).col(2)); };
  const Vec3 from_u = axis(words_.tail<3>()), to_u = axis(to.tail<3>());
  // The same or the opposite axis: no great circle, or every one of them.
  if (from_u.cross(to_u).norm() < kSameWords_rad) return false;
  way.clear();
  Vec3 before = words_.tail<3>();
  for (int k = 1; k <= parts; ++k) {
    const double t = static_cast<double>(k) / parts;
    Vec3 abc;
    if (kinematics_->words_for_axis(slerp(from_u, to_u, t), before, abc) != KinStatus::kOk) return false;
    if (k == parts) {
      if ((abc - Vec3(to.tail<3>())).norm() > kSameWords_rad) return false;
      abc = to.tail<3>();
    }
    // Between two places the words go evenly. The middle of the chord shows how far that is from the circle.
    if ((axis((before + abc) / 2) - slerp(from_u, to_u, t - 0.5 / parts)).norm() > kAxisChord_rad)
      return false;
    Words& next = way.emplace_back(words_ + (to - words_) * t);
    next.tail<3>() = before = abc;
  }
  TRN_CHECK(way.size() == static_cast<std::size_t>(parts));
  way.back() = to;
  return true;
}

void Lowering::arc(const canon::ArcFeed& arc) {
  const bool xy = arc.plane == Plane::kXY, xz = arc.plane == Plane::kXZ;
  const int first = xy ? kX : xz ? kZ : kY, second = xy ? kY : xz ? kX : kZ, normal = xy ? kZ : xz ? kY : kX;
  const double scale = inch_ ? kMmPerInch : 1;
  const std::optional<Entered> entered = std::exchange(entered_, std::nullopt);
  const Words& begins = entered ? entered->from : words_;
  // in the program frame, where the plane is: start, end, centre
  const Vec3 from_P = inverse(X_TP_) * Vec3(begins.head<3>());
  const Vec3 to_P = arc.to.xyz * scale;
  Eigen::Vector2d from(from_P[first], from_P[second]), to(to_P[first], to_P[second]);
  Eigen::Vector2d centre(arc.centre1 * scale, arc.centre2 * scale);
  const Eigen::Vector2d chord = to - from;
  if (chord.norm() > 1e-9) centre = centre_between(from, to, centre);
  const Eigen::Vector2d r1 = from - centre, r2 = to - centre;
  double sweep = std::atan2(r2.y(), r2.x()) - std::atan2(r1.y(), r1.x());
  const double sign = arc.turns > 0 ? 1 : -1;
  sweep *= sign;
  if (chord.norm() <= 1e-9)
    sweep = 2 * kPi;
  else if (sweep <= 0)
    sweep += 2 * kPi;
  TRN_CHECK(arc.turns != 0);
  TRN_CHECK(!(sweep <= 0));
  sweep += 2 * kPi * (std::abs(arc.turns) - 1);
  Vec3 centre_P = from_P;
  centre_P[first] = centre.x();
  centre_P[second] = centre.y();
  Vec3 axis_P = Vec3::Zero();
  axis_P[normal] = 1;
  move_.kind = ProgramMove::Kind::kArc;
  move_.arc_centre = X_TP_ * centre_P;
  move_.arc_axis = X_TP_.R * axis_P;
  move_.arc_sweep_rad = sign * sweep * (1 - (entered ? entered->share : 0));
  const Words words = words_of(arc.to);
  move_.feed = FeedLimit{};
  if (arc.inverse_per_min > 0) {
    move_.duration_s = kSecondsPerMinute / arc.inverse_per_min;
    return send(words);
  }
  send_arc(words);
}

void Lowering::send_arc(const Words& to) {
  const PathPiece whole = make_arc(words_, to, move_.arc_centre, move_.arc_axis, move_.arc_sweep_rad);
  const int parts = parts_by_speed() ? speed_parts(surface_speed(), whole) : 1;
  const Vec3 along = move_.arc_axis * move_.arc_axis.dot((to - words_).head<3>());
  const Vec3 centre = move_.arc_centre;
  move_.arc_sweep_rad /= parts;
  for (int k = 1; k <= parts; ++k) {
    const Words next = k == parts ? to : whole.at(whole.length * k / parts);
    limit_feed(rpm_max_ > 0 && parts == 1 ? least_rpm(surface_speed(), whole) : rpm_for(next));
    move_.feed.rotary_rad_s = FeedLimit::kNone;
    send(next);
    move_.arc_centre = centre + along * k / parts;
  }
}

void Lowering::spline(const canon::NurbsFeed& spline) {
  ProgramWords at = spline.to;
  std::vector<Words> way;
  for (const Vec3& end : spline_chords(*spline.bezier, inch_ ? kMmPerInch : 1)) {
    at[kX] = end.x();
    at[kY] = end.y();
    if (spline.spatial) at[kZ] = end.z();
    const Words words = words_of(at);
    if (words != (way.empty() ? words_ : way.back())) way.push_back(words);
  }
  move_.kind = ProgramMove::Kind::kFeed;
  move_.feed = FeedLimit{};
  if (spline.inverse_per_min == 0) limit_feed(rpm_for(words_));
  move_.feed.rotary_rad_s = FeedLimit::kNone;
  send(way, spline.inverse_per_min);
}

void Lowering::event(QueueEvent::Kind kind, double value, std::int32_t argument) {
  if (spindle_due_ && !geared_) tell_spindle();
  ++move_.source.step;
  sink_.event(QueueEvent{kind, value, argument, overrides_}, move_.source);
}

// The words stay: with another set of corrections the same words are another place of the joints.
void Lowering::switch_corrections(const SwitchCode& code) {
  const auto planned = static_cast<std::uint8_t>(code.corrections & kPlannedBits);
  std::uint8_t& off = move_.context.corrections_off;
  off = static_cast<std::uint8_t>(code.on ? off & ~planned : off | planned);
  event(QueueEvent::Kind::kCorrection, code.on ? 1 : 0, code.corrections);
}

void Lowering::probe(const canon::StraightProbe& probe) {
  if (!config_.io)
    fail(GcodeErrorCode::kNotSupported, 1, g_name(probe.code),
         "no probe input is connected (the machine's config has no section [io])");
  event(QueueEvent::Kind::kProbeStart, 0, tenths(probe.code) % 10);
  straight(probe.to, ProgramMove::Kind::kFeed, 0);
  event(QueueEvent::Kind::kProbeEnd);
}

void Lowering::wait_input(const canon::WaitInput& wait) {
  if (!config_.io)
    fail(GcodeErrorCode::kNotSupported, 1, "M66",
         "no inputs are connected (the machine's config has no section [io])");
  const InputArgument argument{wait.index, static_cast<InputWait>(wait.type), wait.analog};
  event(QueueEvent::Kind::kWaitInput, wait.timeout_s, argument.packed());
}

// In the tick the plan's time follows the spindle; it always has some way up, for that may turn faster.
void Lowering::close_gear(const canon::StartFeedSync& gear) {
  if (!config_.spindle_encoder)
    fail(GcodeErrorCode::kNotSupported, 1, "G33",
         "no spindle encoder is connected (the machine's config has no [io.spindle])");
  // A pitch of 0 is refused where the words are read.
  if (speed_ <= 0 || gear.per_rev <= 0) fail(GcodeErrorCode::kNoSpindle, 1, "G33");
  per_turn_ = gear.per_rev;
  if (geared_ || gear.tap) return;
  // A thread keeps the speed with which it begins, also where it is one of G96.
  if (rpm_max_ > 0 && turning_) event(QueueEvent::Kind::kSpindle, rpm_here());
  gear_rpm_ = std::abs(rpm_here());
  geared_ = true;
  gear_event(GearMode::kSpindleLeads, kGearReserve * gear_rpm_ / kSecondsPerMinute);
}

void Lowering::gear_event(GearMode mode, double turns_s) {
  TRN_CHECK(per_turn_ > 0);
  const double per_turn_mm = inch_ ? per_turn_ * kMmPerInch : per_turn_;
  const auto argument = static_cast<std::int32_t>(mode);
  ++move_.source.step;
  sink_.event({QueueEvent::Kind::kGearStart, turns_s, argument, overrides_, per_turn_mm}, move_.source);
}

// From the spindle's standstill at its mark, so that a second tap meets the groove of the first, to its
// standstill at the depth, and back; the path is no faster than the spindle can follow.
void Lowering::tap(const canon::RigidTap& tap) {
  const Words top = words_, bottom = words_of(tap.to);
  if ((bottom - top).head<3>().norm() <= kTipAtRest)
    fail(GcodeErrorCode::kNotSupported, 1, "G33.1", "the tip goes nowhere: a depth in X, Y or Z is needed");
  const double turns_s = rpm_here() / kSecondsPerMinute;
  const double per_turn_mm = inch_ ? per_turn_ * kMmPerInch : per_turn_;
  event(QueueEvent::Kind::kSpindleOrient);
  gear_event(GearMode::kPathLeads, turns_s);
  const PathMode mode = std::exchange(move_.mode, PathMode::kExactStop);
  traversed_ = false;  // nothing is told between here and the end
  move_.kind = ProgramMove::Kind::kFeed;
  move_.feed = FeedLimit{};
  move_.feed.tip_mm_s = per_turn_mm * std::abs(turns_s);
  if (config_.spindle_rpm_s > 0)
    move_.feed.tip_mm_s2 = kTapShare * config_.spindle_rpm_s / kSecondsPerMinute * per_turn_mm;
  send(bottom);
  event(QueueEvent::Kind::kGearReverse);
  send(top);
  event(QueueEvent::Kind::kGearEnd);
  event(QueueEvent::Kind::kSpindle, turns_s * kSecondsPerMinute);
  spindle_due_ = rpm_max_ > 0 && turning_;
  move_.mode = mode;
}

void Lowering::open_gear() {
  if (!geared_) return;
  event(QueueEvent::Kind::kGearEnd);
  geared_ = false;
  spindle_due_ |= rpm_max_ > 0 && turning_;
}

// With the next move, or at once, between the moves.
void Lowering::output_bit(const canon::SetOutputBit& output) {
  if (output.motion) return move_.outputs.put(output.index, output.on);
  event(QueueEvent::Kind::kDigitalOutput, output.on ? 1 : 0, output.index);
}

void Lowering::output_value(const canon::SetOutputValue& output) {
  if (output.motion && move_.outputs.put(output.index, output.value)) return;
  event(QueueEvent::Kind::kAnalogOutput, output.value, output.index);
}

struct Lowering::Visit {
  Lowering& low;

  void coolant(int bits) const {
    if (bits == low.coolant_ && std::exchange(low.coolant_told_, true)) return;
    low.coolant_told_ = true;
    low.coolant_ = bits;
    low.event(QueueEvent::Kind::kCoolant, 0, bits);
  }
  // M48 to M53. Where they stand in the program they act; the machine does not stop for them.
  void allow(PlainCanon what) const {
    OverrideMode& mode = low.overrides_;
    const bool feed_on = what == PlainCanon::kEnableFeedOverride;
    const bool spindle_on = what == PlainCanon::kEnableSpeedOverride;
    const bool adaptive_on = what == PlainCanon::kEnableAdaptiveFeed;
    const bool hold_on = what == PlainCanon::kEnableFeedHold;
    if (feed_on || what == PlainCanon::kDisableFeedOverride) mode.feed = feed_on;
    if (spindle_on || what == PlainCanon::kDisableSpeedOverride) mode.spindle = spindle_on;
    if (adaptive_on || what == PlainCanon::kDisableAdaptiveFeed) mode.adaptive = adaptive_on;
    if (hold_on || what == PlainCanon::kDisableFeedHold) mode.feed_hold = hold_on;
  }
  void operator()(const canon::Plain& c) const {
    allow(c.what);
    switch (c.what) {
      case PlainCanon::kMistOn:
        return coolant(low.coolant_ | 1);
      case PlainCanon::kMistOff:
        return coolant(low.coolant_ & ~1);
      case PlainCanon::kFloodOn:
        return coolant(low.coolant_ | 2);
      case PlainCanon::kFloodOff:
        return coolant(low.coolant_ & ~2);
      case PlainCanon::kStopFeedSync:
        return low.open_gear();
      case PlainCanon::kProgramStop:
        return low.event(QueueEvent::Kind::kProgramStop);
      case PlainCanon::kOptionalStop:
        return low.event(QueueEvent::Kind::kOptionalStop);
      case PlainCanon::kProgramEnd:  // the coolant, too, that a typed line has switched on
        return low.event(QueueEvent::Kind::kProgramEnd, 0, 1);
      case PlainCanon::kFinish:
        return low.event(QueueEvent::Kind::kProgramEnd);
      default:
        return;
    }
  }
  void operator()(const canon::UseLengthUnits& c) const { low.inch_ = c.inch; }
  void operator()(const canon::SetG5xOffset& c) const {
    low.frame_.g5x = in_mm(c.offset, low.inch_);
    low.set_frame();
  }
  void operator()(const canon::SetG92Offset& c) const {
    low.frame_.g92 = in_mm(c.offset, low.inch_);
    low.set_frame();
  }
  void operator()(const canon::SetXyRotation& c) const {
    low.frame_.rotation_deg = c.deg;
    low.set_frame();
  }
  void operator()(const canon::UseToolLengthOffset& c) const {
    const MmWords tool = in_mm(c.offset, low.inch_);
    // The axes do not move. Words of X Y Z are without the tool, which the joint map adds; those of A B C are
    // the axes', to which nothing is added.
    if (!low.tip_in_table()) low.words_.head<3>() += low.in_words(low.tool_ - tool).xyz;
    low.tool_ = tool;
    low.set_frame();
  }
  void operator()(const canon::SetFeedRate& c) const { low.feed_ = c.per_min; }
  void operator()(const canon::SetFeedMode& c) const { low.per_revolution_ = c.mode == 1; }
  void operator()(const canon::SetMotionControlMode& c) const {
    ProgramMove& m = low.move_;
    m.mode = c.mode == MotionControl::kExactStop   ? PathMode::kExactStop
             : c.mode == MotionControl::kExactPath ? PathMode::kExactPath
                                                   : PathMode::kContinuous;
    const double tolerance = low.inch_ ? c.tolerance * kMmPerInch : c.tolerance;
    m.tolerance_mm = tolerance > 0 ? tolerance : low.config_.tolerance_mm;
    m.tolerance_rad = rad_from_deg(c.orientation_deg > 0 ? c.orientation_deg : low.config_.tolerance_deg);
  }
  void operator()(const canon::StraightTraverse& c) const {
    low.straight(c.to, ProgramMove::Kind::kTraverse, 0);
  }
  void operator()(const canon::ManualRetract& c) const {
    low.straight(c.to, ProgramMove::Kind::kTraverse, 0);
  }
  void operator()(const canon::StraightFeed& c) const {
    low.straight(c.to, ProgramMove::Kind::kFeed, c.inverse_per_min);
  }
  void operator()(const canon::StraightProbe& c) const { low.probe(c); }
  void operator()(const canon::WaitInput& c) const { low.wait_input(c); }
  void operator()(const canon::RigidTap& c) const { low.tap(c); }
  void operator()(const canon::StartFeedSync& c) const { low.close_gear(c); }
  void operator()(const canon::SetOutputBit& c) const { low.output_bit(c); }
  void operator()(const canon::SetOutputValue& c) const { low.output_value(c); }
  void operator()(const canon::OrientSpindle& c) const {
    low.event(QueueEvent::Kind::kSpindleOrient, c.deg, c.direction);
  }
  void operator()(const canon::ArcFeed& c) const { low.arc(c); }
  void operator()(const canon::EnterArc& c) const { low.entered_ = {low.words_of(c.from), c.share}; }
  void operator()(const canon::NurbsFeed& c) const { low.spline(c); }
  void operator()(const canon::Dwell& c) const { low.event(QueueEvent::Kind::kDwell, c.s); }
  void operator()(const canon::SetSpindleSpeed& c) const {
    low.speed_ = c.rpm;
    low.speed_unit_mm_ = low.inch_ ? kInchPerFoot * kMmPerInch : kMmPerMetre;
    if (low.turning_) low.tell_spindle();
  }
  // With G96, and mostly with G97, an S stands on the same line.
  void operator()(const canon::SetSpindleMode& c) const {
    if (c.css_max == low.rpm_max_) return;
    low.rpm_max_ = c.css_max;
    low.spindle_due_ = low.turning_;
  }
  void operator()(const canon::StartSpindle& c) const {
    low.turning_ = true;
    low.clockwise_ = c.clockwise;
    low.tell_spindle();
  }
  void operator()(const canon::StopSpindle&) const {
    if (!low.turning_ && low.spindle_told_) return;
    low.turning_ = false;
    low.tell_spindle();
  }
  void operator()(const canon::ChangeTool& c) const {
    low.event(QueueEvent::Kind::kToolChange, c.confirm, c.tool);
  }
  void operator()(const canon::Message&) const { low.event(QueueEvent::Kind::kMessage); }
  void operator()(const canon::UserM& c) const {
    const SwitchCode* code = find_switch(low.config_, c.code);
    code ? low.switch_corrections(*code) : low.event(QueueEvent::Kind::kUser, c.p, c.code);
  }
  void operator()(const canon::SetRtcp& c) const {
    low.rtcp_ = c.on;
    low.moved_frame(c.to);
  }
  void operator()(const canon::SetSpindleAxis& c) const {
    c.on ? low.event(QueueEvent::Kind::kSpindleOrient, c.deg) : low.event(QueueEvent::Kind::kSpindle, 0);
  }
  void operator()(const canon::SetOrientationPath& c) const { low.great_circle_ = c.great_circle; }
  void operator()(const canon::SetTiltedPlane& c) const {
    low.frame_.tilted = c.on;
    low.frame_.origin = low.inch_ ? Vec3(c.origin * kMmPerInch) : c.origin;
    low.frame_.R_tilt = c.R;
    low.aligned_ = c.on && c.aligned;
    low.moved_frame(c.to);
  }
  template <typename Other>
  void operator()(const Other&) const {}  // nothing moves, nothing happens at the machine
};

void Lowering::put(const CanonCommand& command, std::uint32_t line) {
  move_.source.line = line;
  std::visit(Visit{*this}, command);
}

}  // namespace trn

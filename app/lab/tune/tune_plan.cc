#include "app/lab/tune/tune_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/units.h"

namespace trn {

namespace {

constexpr double kTuneMargin = 0.02;                                 // of the range, to either end
constexpr double kEvenSpeeds[] = {0.02, 0.05, 0.1, 0.2, 0.35, 0.5};  // of the greatest speed
constexpr double kEvenTimeS = 1;                                     // of one slow stroke
constexpr int kEvenTurns = 2, kFastTurns = 4;
constexpr double kShortLengths[] = {0.31, 0.12, 0.2, 0.07, 0.26, 0.16, 0.1, 0.23};  // of the length
constexpr double kCreepShare = 0.002, kCreepTimeS = 1.5;
constexpr int kCreepTurns = 4;
constexpr double kEndlessRange = 8 * kPi;
constexpr double kPitches = 6, kPitchTimeS = 0.64, kSlowestCogging = 0.01;
constexpr int kCoggingTurns = 2;
constexpr double kStirredSpeed = 0.15, kStirredTimeS = 3;
constexpr int kStirredTurns = 3;

/// Where a stroke of this length and speed reaches the speed at all, and how long it takes.
double stroke_time_s(const JointLimit& limit, const TuneStroke& stroke) {
  const double ramp_s = stroke.speed / limit.acceleration + limit.acceleration / limit.jerk;
  return std::abs(stroke.way) / stroke.speed + ramp_s + 0.3;
}

void there_and_back(TunePlan& plan, double way, double speed, int turns) {
  for (int i = 0; i < turns; ++i) {
    plan.strokes.push_back({way, speed});
    plan.strokes.push_back({-way, speed});
  }
}

// The way that the greatest speed needs to be reached and left, and as much at that speed.
double length_for(const JointLimit& limit, double speed) {
  return 4 * speed * (speed / limit.acceleration + limit.acceleration / limit.jerk);
}

// Weight that turns with the joint is told from an even one over a wide angle only.
double usual_length(const Joint& joint, double speed) {
  const double quarter = 0.25 * (joint.endless ? kEndlessRange : joint.limit.max - joint.limit.min);
  const double least = joint.kind == JointKind::kRotary ? 90 * kRadPerDeg : 0;
  return std::min(quarter, std::max(least, length_for(joint.limit, speed)));
}

// Whole pitches, so slowly that the finest wave is not smoothed away, and not so slowly that friction is
// unsure.
void add_cogging(TunePlan& plan, const Joint& joint, double length, double pitch) {
  const double pitches = std::min(kPitches, std::floor(std::abs(length) / pitch));
  const bool rotary = joint.kind == JointKind::kRotary;
  if (pitches < 2)
    throw std::runtime_error(
        fmt::format("the table of cogging needs two pitches of way, {:.4g} {}, and joint {} will go "
                    "{:.4g}; say a longer --length",
                    2 * pitch * (rotary ? kDegPerRad : 1), rotary ? "deg" : "mm", joint.name,
                    std::abs(length) * (rotary ? kDegPerRad : 1)));
  const double speed =
      std::clamp(pitch / kPitchTimeS, kSlowestCogging * joint.limit.velocity, plan.speed_max);
  there_and_back(plan, std::copysign(pitches * pitch, length), speed, kCoggingTurns);
}

}  // namespace

TunePlan plan_tuning(const Joint& joint, double stands, const TuneWish& wish) {
  const JointLimit& limit = joint.limit;
  // A joint without an end has room enough wherever it stands.
  const double range = joint.endless ? kEndlessRange : limit.max - limit.min, margin = kTuneMargin * range;
  const double up = joint.endless ? kEndlessRange : limit.max - margin - stands;
  const double down = joint.endless ? 0 : stands - limit.min - margin;
  TunePlan plan;
  plan.speed_max = std::clamp(wish.speed_share, 0.05, 1.0) * limit.velocity;
  const double room = std::max(up, down);
  double length = wish.length > 0 ? wish.length : usual_length(joint, plan.speed_max);
  if (wish.length > room || room < 0.02 * range)
    throw std::runtime_error(
        fmt::format("joint {} has no room for that from where it stands; jog it towards its middle, or say a "
                    "shorter --length",
                    joint.name));
  length = std::min(length, room);
  // A short way is not gone faster than it can be left again.
  while (length_for(limit, plan.speed_max) > 3 * length && plan.speed_max > 0.02 * limit.velocity)
    plan.speed_max *= 0.9;
  const double sign = up >= down ? 1 : -1;
  for (const double share : kEvenSpeeds) {
    const double speed = share * plan.speed_max;
    there_and_back(plan, sign * std::min(length, kEvenTimeS * speed), speed, kEvenTurns);
  }
  there_and_back(plan, sign * length, plan.speed_max, kFastTurns);
  for (const double share : kShortLengths) there_and_back(plan, sign * share * length, plan.speed_max, 1);
  if (wish.cogging_pitch > 0) add_cogging(plan, joint, sign * length, wish.cogging_pitch);
  plan.first_slow = plan.strokes.size();
  const double creep = kCreepShare * limit.velocity;
  there_and_back(plan, sign * kCreepTimeS * creep, creep, kCreepTurns);
  if (wish.stirs) {
    plan.first_stirred = plan.strokes.size();
    const double speed = std::min(kStirredSpeed * plan.speed_max, length / kStirredTimeS);
    there_and_back(plan, sign * std::min(length, kStirredTimeS * speed), speed, kStirredTurns);
  }
  for (const TuneStroke& stroke : plan.strokes) plan.time_s += stroke_time_s(limit, stroke);
  plan.from = std::min(stands, stands + sign * length);
  plan.to = std::max(stands, stands + sign * length);
  return plan;
}

std::string announcement(const TunePlan& plan, const Joint& joint) {
  const bool rotary = joint.kind == JointKind::kRotary;
  const double unit = rotary ? kDegPerRad : 1;
  const std::string shaken =
      plan.first_stirred < plan.strokes.size()
          ? "In the last strokes its motor is shaken by a small torque, which is heard.\n"
          : "";
  return shaken + fmt::format(
                      "Joint {} will move between {:.1f} and {:.1f} {}, {} times, at most at {:.4g} {}/s, "
                      "for about {:.0f} "
                      "s. Nothing "
                      "else moves.\n",
                      joint.name, unit * plan.from, unit * plan.to, rotary ? "deg" : "mm",
                      plan.strokes.size(), unit * plan.speed_max, rotary ? "deg" : "mm", plan.time_s);
}

}  // namespace trn

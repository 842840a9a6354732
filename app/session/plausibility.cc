#include "app/session/plausibility.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "app/session/word_directions.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/serial_branches.h"
#include "core/units.h"

namespace trn {

namespace {

// Beyond what is built: fast routers and linear motors stay below, the slowest vertical lathes above.
constexpr double kVelocityMax = 4000, kVelocityMin = 0.5;  // mm/s
constexpr double kTurnMax = 20000, kTurnMin = 0.05;        // deg/s: 3,300 rev/min
constexpr double kGravity = 9810;                          // mm/s^2
constexpr double kAccelerationMax = 10 * kGravity, kAccelerationMin = 5;
constexpr double kRampMin_s = 0.0005, kRampMax_s = 2, kRampUsual_s = 0.05;  // acceleration over jerk
constexpr double kRunUpMax_s = 20;                                          // velocity over acceleration
constexpr double kRangeMax = 50000, kRangeMin = 0.5;                        // mm
constexpr double kParallel = 0.999;

/// Asks about one joint.
class JointQuestions {
 public:
  JointQuestions(const ConfigTable& table, const Joint& joint, std::vector<std::string>& out)
      : table_(table), joint_(joint), rotary_(joint.kind == JointKind::kRotary), out_(out) {}

  void ask() {
    velocity();
    acceleration();
    jerk();
    range();
  }

 private:
  std::string key(const char* stem, const char* rest = "") const {
    return fmt::format("{}_{}{}", stem, rotary_ ? "deg" : "mm", rest);
  }
  double shown(double value) const { return rotary_ ? deg_from_rad(value) : value; }
  const char* unit() const { return rotary_ ? "deg" : "mm"; }
  void question(const std::string& key, const std::string& text) {
    out_.push_back(table_.error(key, fmt::format("joint {}: {}", joint_.name, text)).what());
  }

  void velocity() {
    const double v = shown(joint_.limit.velocity);
    const std::string name = key("velocity", "_s");
    if (v > (rotary_ ? kTurnMax : kVelocityMax))
      question(name, rotary_
                         ? fmt::format("{:g} deg/s is {:.3g} turns a minute; if it is meant in deg/min, "
                                       "{:.4g} would be right",
                                       v, v / 6, v / 60)
                         : fmt::format("{:g} mm/s is {:.4g} m/min; if it is meant in mm/min, {:.4g} would be "
                                       "right",
                                       v, 0.06 * v, v / 60));
    else if (v < (rotary_ ? kTurnMin : kVelocityMin))
      question(name,
               fmt::format("{:g} {}/s is very slow: the whole range takes {:.3g} minutes; is it meant in "
                           "{}/s?",
                           v, unit(), shown(joint_.limit.max - joint_.limit.min) / v / 60,
                           rotary_ ? "turns" : "m"));
  }

  void acceleration() {
    const double a = shown(joint_.limit.acceleration),
                 run_up = joint_.limit.velocity / joint_.limit.acceleration;
    const std::string name = key("acceleration", "_s2");
    if (!rotary_ && a > kAccelerationMax)
      question(name, fmt::format("{:g} mm/s^2 is {:.3g} times gravity; machines have 500 to 20000", a,
                                 a / kGravity));
    else if (!rotary_ && a < kAccelerationMin)
      question(name, fmt::format("{:g} mm/s^2 is very little; if it is meant in m/s^2, {:g} would be right",
                                 a, 1000 * a));
    else if (run_up > kRunUpMax_s)
      question(name, fmt::format("full speed is reached after {:.3g} s only; {:.3g} would take half a second",
                                 run_up, 2 * shown(joint_.limit.velocity)));
  }

  void jerk() {
    const double ramp = joint_.limit.acceleration / joint_.limit.jerk;
    const std::string name = key("jerk", "_s3");
    const double usual = shown(joint_.limit.acceleration) / kRampUsual_s;
    if (ramp < kRampMin_s)
      question(name, fmt::format(
                         "with {:g} {}/s^3 the full acceleration is there after {:.2g} us, which is a blow; "
                         "acceleration / 0.05 s = {:.4g} is a good start",
                         shown(joint_.limit.jerk), unit(), 1e6 * ramp, usual));
    else if (ramp > kRampMax_s)
      question(name, fmt::format("with {:g} {}/s^3 the full acceleration is there after {:.3g} s only; "
                                 "acceleration / 0.05 s = {:.4g} is a good start",
                                 shown(joint_.limit.jerk), unit(), ramp, usual));
  }

  void range() {
    const double range = shown(joint_.limit.max - joint_.limit.min);
    if (rotary_) return;
    if (range > kRangeMax)
      question(key("max"), fmt::format("a range of {:g} m is hardly one of a machine", range / 1000));
    else if (range < kRangeMin)
      question(key("max"),
               fmt::format("a range of {:g} mm is hardly one of a machine; is it meant in m?", range));
  }

  const ConfigTable& table_;
  const Joint& joint_;
  bool rotary_;
  std::vector<std::string>& out_;
};

bool parallel(const BranchAxis& a, const BranchAxis& b) {
  return a.kind == b.kind && std::abs(a.direction.dot(b.direction)) > kParallel;
}

// Two linear axes along one line do what one could; the third direction is missing then.
void ask_parallel(const Machine& machine, std::vector<std::string>& out) {
  const ConfigTable section = machine.root.table("kinematics");
  if (section.text("type") != "serial") return;
  const SerialBranches branches = read_branches(section, machine.joints);
  std::vector<BranchAxis> axes = branches.tool;
  axes.insert(axes.end(), branches.work.begin(), branches.work.end());
  std::vector<BranchAxis> linear;
  for (const BranchAxis& axis : axes)
    if (axis.joint >= 0 && axis.kind == JointKind::kLinear) linear.push_back(axis);
  for (std::size_t i = 0; i < linear.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      if (!parallel(linear[i], linear[k])) continue;
      const auto name = [&](const BranchAxis& axis) {
        return machine.joints[static_cast<std::size_t>(axis.joint)].name;
      };
      out.push_back(
          linear[i]
              .table
              .error("direction", fmt::format("joints {} and {} move along the same line; is one of "
                                              "the directions wrong?",
                                              name(linear[k]), name(linear[i])))
              .what());
    }
}

// Serial machines only: the words of others are poses. Rotary tables are often built to turn by the word
// themselves, against ISO 841, so that these are not asked about.
void ask_directions(const Machine& machine, const Kinematics& kinematics, std::vector<std::string>& out) {
  if (!kinematics.words_are_joints()) return;
  for (const WordDirection& direction : word_directions(kinematics, Words::Zero())) {
    if (direction.word > kZ || direction.as_iso_841()) continue;
    const char word = kWordLetters[direction.word];
    out.push_back(
        fmt::format("{}: with a positive word {} {}; ISO 841 has it go towards +{}. Look at 'sense' and "
                    "'direction' ('trunnion kin words')",
                    machine.root.file(), word, describe(direction, machine), word));
  }
}

}  // namespace

std::vector<std::string> implausible(const Machine& machine, const Kinematics& kinematics) {
  std::vector<std::string> out;
  const std::vector<ConfigTable> tables = machine.root.tables("joint");
  for (std::size_t i = 0; i < tables.size(); ++i) JointQuestions(tables[i], machine.joints[i], out).ask();
  ask_parallel(machine, out);
  ask_directions(machine, kinematics, out);
  return out;
}

}  // namespace trn

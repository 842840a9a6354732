#include "app/cli/kin_words.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "app/session/word_directions.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/frames.h"
#include "core/letter_case.h"
#include "core/serial_branches.h"
#include "core/units.h"
#include "kinematics/platform_kinematics.h"

namespace trn {

namespace {

double word_number(const std::string& item, std::string_view text) {
  double value = 0;
  if (!text.empty() && text[0] == '+') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || text.empty() || !std::isfinite(value))
    throw std::invalid_argument(fmt::format("'{}' has no number behind it, as X12.5", item));
  return value;
}

// -0.000 is 0.
double shown_number(double value) {
  const double out = std::round(value * 1e6) / 1e6;
  return out == 0 ? 0 : out;
}

std::vector<std::string> kin_items(const std::string& line) {
  std::istringstream in(line);
  std::vector<std::string> out;
  for (std::string item; in >> item;) out.push_back(item);
  return out;
}

enum class Carries { kTool, kWork };

// What of a machine of axes in a row a joint moves; a machine of another kind turns its tool.
Carries carried_by(const JointVec& moved, const Machine& machine) {
  const ConfigTable section = machine.root.table("kinematics");
  if (section.text("type") != "serial") return Carries::kTool;
  for (const BranchAxis& axis : read_branches(section, machine.joints).work)
    if (axis.joint >= 0 && std::abs(moved[axis.joint]) > 0.5) return Carries::kWork;
  return Carries::kTool;
}

// A leaning axis has a part of its own word and is none the worse for it; only a way or turn against the word
// is worth a remark.
std::string iso_841_remark(const WordDirection& direction, const Machine& machine) {
  constexpr double kSeen = 0.05;
  if (!direction.known) return "";
  if (direction.word <= kZ)
    return direction.tip[direction.word] > kSeen ? "" : "  <- the wrong way by ISO 841";
  if (direction.turn[direction.word - kA] > -kSeen) return "";
  return carried_by(direction.joints, machine) == Carries::kWork
             ? "  <- the table turns by the word; ISO 841 has the tool do so"
             : "  <- the tool turns against the word; ISO 841 has it turn by the word";
}

double kin_unit(const Joint& joint) { return joint.kind == JointKind::kRotary ? kRadPerDeg : 1; }

std::string shown_words(const Words& words, unsigned mask) {
  std::string out;
  for (int i = kX; i <= kC; ++i)
    if (mask >> i & 1u)
      out +=
          fmt::format(" {}{:g}", kWordLetters[i], shown_number(i <= kZ ? words[i] : deg_from_rad(words[i])));
  return out;
}

}  // namespace

KinWords::KinWords(const Machine& machine, const Kinematics& kinematics)
    : machine_(machine), kinematics_(kinematics) {
  JointVec q;
  const auto* platform = dynamic_cast<const PlatformKinematics*>(&kinematics);
  if (!platform || kinematics.joints_from_words(rest_, q) == KinStatus::kOk) return;
  rest_.head<3>() = platform->spindle_from_platform(platform->home()).p;
}

// Where the gauge point is, and how the tool points, in the axes of a program.
std::string KinWords::tip_text(const JointVec& q) const {
  Pose X_BS;
  if (kinematics_.forward(q, X_BS) != KinStatus::kOk) return "the machine has no place there";
  const Pose X_MB = trn::inverse(kinematics_.home_X_BM());
  const Vec3 p = X_MB.R * X_BS.p + X_MB.p, u = X_MB.R * X_BS.R.col(2);
  return fmt::format("tool at X{:g} Y{:g} Z{:g}, points along I{:g} J{:g} K{:g}, seen from the work",
                     shown_number(p[0]), shown_number(p[1]), shown_number(p[2]), shown_number(u[0]),
                     shown_number(u[1]), shown_number(u[2]));
}

std::string KinWords::forward(const std::string& line) const {
  std::vector<std::string> names;
  for (const Joint& joint : machine_.joints) names.push_back(joint.name);
  JointVec q;
  if (kinematics_.joints_from_words(rest_, q) != KinStatus::kOk)
    q = JointVec::Zero(kinematics_.joint_count());
  for (const std::string& item : kin_items(line)) {
    const std::size_t sign = item.find('=');
    const std::string name = item.substr(0, sign);
    const auto found = std::find(names.begin(), names.end(), name);
    if (sign == std::string::npos || found == names.end())
      throw std::invalid_argument(fmt::format("'{}' is no joint with its place, as {}=10; joints: {}", item,
                                              names[0], fmt::join(names, ", ")));
    const auto i = static_cast<std::size_t>(found - names.begin());
    q[static_cast<Eigen::Index>(i)] =
        kin_unit(machine_.joints[i]) * word_number(item, std::string_view(item).substr(sign + 1));
  }
  Words words;
  if (kinematics_.words_from_joints(q, words) != KinStatus::kOk) return "no words lead there; " + tip_text(q);
  return "words" + shown_words(words, kinematics_.word_mask()) + "; " + tip_text(q);
}

std::string KinWords::inverse(const std::string& line) const {
  Words words = rest_;
  for (const std::string& item : kin_items(line)) {
    const char letter = upper_case(item[0]);
    const std::size_t word = std::string_view(kWordLetters).find(letter);
    const bool legal = word != std::string_view::npos && word <= kC && (kinematics_.word_mask() >> word & 1u);
    if (!legal) throw std::invalid_argument(fmt::format("'{}' is no word of this machine, as X10", item));
    const double value = word_number(item, std::string_view(item).substr(1));
    words[static_cast<Eigen::Index>(word)] = word <= kZ ? value : rad_from_deg(value);
  }
  JointVec q;
  if (kinematics_.joints_from_words(words, q) != KinStatus::kOk)
    return "the machine cannot go to" + shown_words(words, kinematics_.word_mask());
  std::string out = "joints", beyond;
  for (std::size_t i = 0; i < machine_.joints.size(); ++i) {
    const Joint& joint = machine_.joints[i];
    const double place = q[static_cast<Eigen::Index>(i)];
    out += fmt::format(" {}={:g}", joint.name, shown_number(place / kin_unit(joint)));
    if (place < joint.limit.min || place > joint.limit.max) beyond += " " + joint.name;
  }
  return out + "; " + tip_text(q) + (beyond.empty() ? "" : "; beyond the range of" + beyond);
}

std::string KinWords::directions() const {
  std::string out;
  if (!rest_.isZero())
    out = fmt::format("From the platform's home,{}:\n", shown_words(rest_, kinematics_.word_mask()));
  for (const WordDirection& direction : word_directions(kinematics_, rest_))
    out += fmt::format("{}+  {}{}\n", kWordLetters[direction.word], describe(direction, machine_),
                       iso_841_remark(direction, machine_));
  return out;
}

}  // namespace trn

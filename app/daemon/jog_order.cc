#include "app/daemon/jog_order.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <vector>

#include "core/check.h"
#include "core/units.h"
#include "kernel/joint_jog.h"

namespace trn {

namespace {

constexpr double kNoWay = 1e-9;  // mm, rad
constexpr double kFarWay = 1e6;  // the same, of a jog that goes on until it is let go

std::string joint_names(const Joints& joints) {
  std::vector<std::string> names;
  for (const Joint& joint : joints) names.push_back(joint.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

// The word's joint; or, where the word moves several, a joint that is called like it.
std::optional<WordJoint> find_joint(const std::string& word, const Kinematics* kinematics,
                                    const Joints& joints) {
  const std::size_t index = std::string_view(kWordLetters).find(word);
  if (kinematics && word.size() == 1 && index != std::string_view::npos)
    if (const auto found = joint_of_word(*kinematics, static_cast<int>(index))) return found;
  for (std::size_t i = 0; i < joints.size(); ++i)
    if (joints[i].name == word) return WordJoint{static_cast<int>(i), 1};
  return std::nullopt;
}

// "X, Y, Z"
std::string axis_words(const Kinematics* kinematics) {
  std::string out;
  for (std::size_t i = 0; kinematics && kWordLetters[i] != 0; ++i)
    if (kinematics->word_mask() >> i & 1U)
      out += fmt::format("{}{}", out.empty() ? "" : ", ", kWordLetters[i]);
  return out;
}

}  // namespace

std::optional<WordJoint> joint_of_word(const Kinematics& kinematics, int word) {
  constexpr double kStep = 0.125, kExact = 1e-9;
  if ((kinematics.word_mask() >> word & 1U) == 0) return std::nullopt;
  Words words = Words::Zero();
  JointVec before, after;
  if (kinematics.joints_from_words(words, before) != KinStatus::kOk) return std::nullopt;
  words[word] = kStep;
  if (kinematics.joints_from_words(words, after) != KinStatus::kOk) return std::nullopt;
  const JointVec way = after - before;
  Eigen::Index joint = 0;
  const double most = way.cwiseAbs().maxCoeff(&joint);
  const bool alone = way.cwiseAbs().sum() - most < kExact && std::abs(most - kStep) < kExact;
  if (!alone) return std::nullopt;
  return WordJoint{static_cast<int>(joint), way[joint] < 0 ? -1.0 : 1.0};
}

JogOrder plan_jog(const JogWish& wish, const Kinematics* kinematics, const Joints& joints,
                  const JointVec& q) {
  JogOrder order;
  std::optional<WordJoint> found = WordJoint{wish.joint, 1};
  if (!wish.word.empty()) found = find_joint(wish.word, kinematics, joints);
  if (!found) {
    const std::string axes = axis_words(kinematics);
    const bool has = axes.find(wish.word) != std::string::npos;
    order.refusal =
        !has && !axes.empty() && std::string_view(kWordLetters).find(wish.word) != std::string_view::npos
            ? fmt::format("this machine has no axis {}; it has {}", wish.word, axes)
            : fmt::format("no single joint moves for '{}'; jog it '--along machine', or one of the joints {}",
                          wish.word, joint_names(joints));
    return order;
  }
  order.joint = found->joint;
  TRN_CHECK(found->joint >= 0 && static_cast<std::size_t>(found->joint) < joints.size());
  const Joint& joint = joints[static_cast<std::size_t>(found->joint)];
  const std::string& name = wish.word.empty() ? joint.name : wish.word;
  const double way = wish.held && wish.way != 0 ? std::copysign(kFarWay, wish.way) : wish.way;
  const double from = q[found->joint], wanted = found->sense * way;
  const double target = jog_target(joint.limit, from, wanted);
  const double unit = joint.kind == JointKind::kRotary ? kDegPerRad : 1.0;
  const char* const units = joint.kind == JointKind::kRotary ? "deg" : "mm";
  order.way = wanted;
  order.speed = wish.speed > 0 ? wish.speed : wish.speed_share * joint.limit.velocity;
  if (wish.moves || wish.way == 0) return order;
  const double shorter = std::abs(wanted) - std::abs(target - from);
  if (shorter > kNoWay && std::abs(target - from) < kNoWay) {
    order.refusal = fmt::format("{} stands at its limit, {:.4f} {}, and cannot go further that way; jog back",
                                name, unit * found->sense * from, units);
    return order;
  }
  if (shorter > kNoWay && !wish.held)
    order.remark = fmt::format("{} stops at its limit, {:.4f} {}: {:.4f} {} instead of {:.4f}\n", name,
                               unit * found->sense * target, units, unit * std::abs(target - from), units,
                               unit * std::abs(wanted));
  if (wish.speed > joint.limit.velocity)
    order.remark += fmt::format("{} goes at its limit of {:g} {}/s instead of {:g}\n", name,
                                unit * joint.limit.velocity, units, unit * wish.speed);
  if (!order.remark.empty()) order.remark.pop_back();
  return order;
}

}  // namespace trn

#include "app/daemon/direction_jog.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/check.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/units.h"
#include "interp/gcode/g_code.h"

namespace trn {

namespace {

constexpr double kEndlessWay = 1e5;    // mm, rad: of a jog that goes on until it is let go
constexpr double kDefaultShare = 0.1;  // of the speed at which the first joint comes to its limit
constexpr double kProbe = 1e-3;        // mm, rad: for derivatives
constexpr double kFinest = 1e-6;       // mm, rad: of the program's figures; a shorter way is none
constexpr double kRounding = 1e-9;     // mm, rad
constexpr int kSamples = 200;          // of the way, looked at for limits
constexpr int kHalvings = 40;

const char* frame_name(JogFrame frame) {
  return frame == JogFrame::kMachine ? "machine" : frame == JogFrame::kWork ? "work" : "tool";
}

/// The jog's straight way in machine words, from where the machine stands.
struct Line {
  Words from = Words::Zero(), direction = Words::Zero();
  std::uint8_t corrections_off = 0;
  Words at(double way) const { return from + way * direction; }
};

std::optional<JointVec> joints_at(const DirectionParts& parts, const Line& line, double way) {
  MapContext context;
  context.corrections_off = line.corrections_off;
  JointVec q;
  if (parts.map.map(line.at(way), context, q) != KinStatus::kOk) return std::nullopt;
  return q;
}

// Of the machine words, for a displacement of the spindle in the table frame.
std::optional<Words> words_along(const Kinematics& kinematics, const Words& from, const Vec3& u_B) {
  JointVec q, there;
  Pose X_BS;
  if (kinematics.joints_from_words(from, q) != KinStatus::kOk) return std::nullopt;
  if (kinematics.forward(q, X_BS) != KinStatus::kOk) return std::nullopt;
  X_BS.p += u_B;
  Words before, after;
  if (kinematics.inverse(X_BS, q, there) != KinStatus::kOk) return std::nullopt;
  if (kinematics.words_from_joints(q, before) != KinStatus::kOk) return std::nullopt;
  if (kinematics.words_from_joints(there, after) != KinStatus::kOk) return std::nullopt;
  Words direction = after - before;
  direction.tail<3>().setZero();
  return direction;
}

std::optional<Line> line_of(const DirectionWish& wish, const DirectionParts& parts, const JointVec& q) {
  Line line;
  const MapContext& context = parts.step.context;
  line.corrections_off = context.corrections_off;
  if (parts.map.words_at(q, line.corrections_off, line.from) != KinStatus::kOk) return std::nullopt;
  const Vec3 axis = Vec3::Unit(std::min(wish.word, static_cast<int>(kZ)));
  if (wish.frame == JogFrame::kMachine) {
    line.direction[wish.word] = 1;
    return line;
  }
  Vec3 u = parts.step.frame.X_TP.R * axis;
  const bool of_table = wish.frame == JogFrame::kTool || context.rtcp;
  if (wish.frame == JogFrame::kTool) {
    Pose X_BS;
    if (parts.map.reached(q, line.corrections_off, X_BS) != KinStatus::kOk) return std::nullopt;
    u = X_BS.R * axis;
  }
  line.direction.head<3>() = u;
  if (!of_table) return line;
  const auto along = words_along(parts.kinematics, line.from, u);
  if (!along) return std::nullopt;
  line.direction = *along;
  return line;
}

// A joint that stands outside its range may come back.
bool within(const Joints& joints, const JointVec& from, const JointVec& q) {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const JointLimit& limit = joints[i].limit;
    if (q[k] < std::min(limit.min, from[k]) - kRounding || q[k] > std::max(limit.max, from[k]) + kRounding)
      return false;
  }
  return true;
}

// The longest part of the way that all joints can go; the sample where it first cannot is looked at closer.
double reachable(const DirectionParts& parts, const Line& line, const JointVec& q, double way) {
  const auto legal = [&](double part) {
    const auto there = joints_at(parts, line, part);
    return there && within(parts.joints, q, *there);
  };
  double widest = 0;
  for (const Joint& joint : parts.joints) widest += joint.limit.max - joint.limit.min;
  const double farthest = std::copysign(std::min(std::abs(way), widest), way);
  double good = 0, bad = farthest;
  int i = 1;
  for (; i <= kSamples; ++i) {
    bad = farthest * i / kSamples;
    if (!legal(bad)) break;
    good = bad;
  }
  if (i > kSamples) return good;
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = (good + bad) / 2;
    (legal(middle) ? good : bad) = middle;
  }
  return std::copysign(std::max(0.0, std::abs(good) - kFinest), way);
}

// Of the way, per s, at which the first joint comes to its velocity limit; the joints move by the way's own
// derivative where it begins.
double greatest_speed(const DirectionParts& parts, const Line& line, const JointVec& q, double way) {
  const auto there = joints_at(parts, line, std::copysign(kProbe, way));
  if (!there) return 0;
  double greatest = 1e9;
  for (std::size_t i = 0; i < parts.joints.size(); ++i) {
    const double slope =
        std::abs((*there)[static_cast<Eigen::Index>(i)] - q[static_cast<Eigen::Index>(i)]) / kProbe;
    if (slope > kFinest) greatest = std::min(greatest, parts.joints[i].limit.velocity / slope);
  }
  return greatest;
}

double off_max(const Joint& joint) {
  return joint.kind == JointKind::kRotary ? kStretchOff_rad : kStretchOff_mm;
}

// Joints that move in proportion pass the middle within the limit.
bool straight(const Joints& joints, const JointVec& from, const JointVec& middle, const JointVec& to) {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (std::abs(middle[k] - (from[k] + to[k]) / 2) > off_max(joints[i])) return false;
  }
  return true;
}

// By how long a jog of a joint lags behind its demand: the means of JointJog, s.
double lag_s(const JointLimit& limit, double speed) {
  const double first = std::max(speed / limit.acceleration, std::sqrt(2 * speed / limit.jerk));
  return first > 0 ? (first + std::min(first, 2 * speed / (first * limit.jerk))) / 2 : 0;
}

// Of the speeds by / time_s, so that joints of unlike ramps leave the straight line by less than the limit.
double straight_share(const Joints& joints, const JointVec& by, double time_s) {
  constexpr double kSlower = 0.8;
  double share = 1;
  for (int i = 0; i < kHalvings; ++i, share *= kSlower) {
    double most_s = 0, worst = 0;
    for (std::size_t j = 0; j < joints.size(); ++j)
      if (const double way = std::abs(by[static_cast<Eigen::Index>(j)]); way > kRounding)
        most_s = std::max(most_s, lag_s(joints[j].limit, share * way / time_s));
    for (std::size_t j = 0; j < joints.size(); ++j) {
      const double speed = share * std::abs(by[static_cast<Eigen::Index>(j)]) / time_s;
      worst = std::max(worst, speed * (most_s - lag_s(joints[j].limit, speed)) / off_max(joints[j]));
    }
    if (worst <= 1) break;
  }
  return share;
}

// M72 brings all modes back but that of the motion.
std::string program_of(const Line& line, double way, double speed, GCode motion_mode) {
  const Words to = line.at(way);
  std::string move = "G53 G1";
  for (int k = kX; k <= kC; ++k)
    if (line.direction[k] != 0)
      move += fmt::format(" {}{:.6f}", kWordLetters[k], k >= kA ? kDegPerRad * to[k] : to[k]);
  const bool rotary = line.direction.head<3>().isZero(0);
  const std::string mode = motion_mode == 0_g ? "G0\n" : motion_mode == 80_g ? "G80\n" : "";
  return fmt::format("M70\nG21 G90 G94 {} F{:.4f}\nM72\n{}", move, 60 * (rotary ? kDegPerRad : 1) * speed,
                     mode);
}

}  // namespace

DirectionOrder plan_direction_jog(const DirectionWish& wish, const DirectionParts& parts, const JointVec& q) {
  TRN_CHECK(wish.word >= kX && wish.word <= kC);
  TRN_CHECK(std::isfinite(wish.way) && wish.speed >= 0);
  DirectionOrder order;
  const char letter = kWordLetters[wish.word];
  if (wish.frame != JogFrame::kMachine && wish.word > kZ) {
    order.refusal = fmt::format("{} has no direction of its own along the {}: X, Y and Z have", letter,
                                frame_name(wish.frame));
    return order;
  }
  if (wish.frame == JogFrame::kMachine && (parts.kinematics.word_mask() >> wish.word & 1U) == 0) {
    order.refusal = fmt::format("the machine has no axis {}", letter);
    return order;
  }
  const auto line = line_of(wish, parts, q);
  if (!line) {
    order.refusal = "the machine stands where its position has no axis words; jog its joints by their names";
    return order;
  }
  const double way = wish.held ? std::copysign(kEndlessWay, wish.way) : wish.way;
  const double possible = reachable(parts, *line, q, way);
  const bool rotary = wish.word >= kA;
  const double unit = rotary ? kDegPerRad : 1;
  const char* const units = rotary ? "deg" : "mm";
  if (std::abs(possible) < kFinest) {
    order.refusal = fmt::format("{} of the {} cannot go further that way: a joint is at its limit; jog back",
                                letter, frame_name(wish.frame));
    return order;
  }
  if (!wish.held && std::abs(way) - std::abs(possible) > kFinest)
    order.remark =
        fmt::format("{} of the {} stops where a joint is at its limit: {:.4f} {} instead of {:.4f}", letter,
                    frame_name(wish.frame), unit * std::abs(possible), units, unit * std::abs(way));
  const double greatest = greatest_speed(parts, *line, q, way);
  const double share = wish.speed_share > 0 ? wish.speed_share : kDefaultShare;
  order.way = possible;
  order.speed = wish.speed > 0 ? std::min(wish.speed, greatest) : share * greatest;
  order.program = program_of(*line, possible, order.speed, parts.step.settings.motion);
  return order;
}

std::vector<JogStretch> plan_stretch(const DirectionWish& wish, const DirectionParts& parts,
                                     const JointVec& q, double way, double speed, double& part) {
  part = 0;
  const auto line = line_of(wish, parts, q);
  if (!line || !(speed > 0)) return {};
  JointVec to;
  for (double share = 1; share > 1e-4; share /= 2) {
    const auto there = joints_at(parts, *line, share * way),
               middle = joints_at(parts, *line, share * way / 2);
    if (!there || !middle) return {};
    to = *there;
    part = share * way;
    if (straight(parts.joints, q, *middle, to)) break;
  }
  const JointVec by = to - q;
  speed *= straight_share(parts.joints, by, std::abs(part) / speed);
  std::vector<JogStretch> stretches;
  for (Eigen::Index i = 0; i < by.size(); ++i)
    if (std::abs(by[i]) > kRounding)
      stretches.push_back({static_cast<int>(i), by[i], std::abs(by[i]) * speed / std::abs(part)});
  return stretches;
}

}  // namespace trn

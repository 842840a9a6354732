#include "app/session/range_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/path.h"
#include "core/ports.h"
#include "core/units.h"

namespace trn {

namespace {

constexpr double kRounding = 1e-9;
constexpr double kSampleStep_mm = 5;
constexpr int kSamplesMax = 200;
constexpr int kArcSamplesMin = 16;
constexpr double kShortMove_mm = 1;  // in the middle of such a straight no joint turns far back
constexpr double kSameTurn = 1e-3;   // of a step between places
constexpr int kTurnHalvings = 40;    // of an interval about the place where a joint turns back

}  // namespace

RangeCheck::RangeCheck(const Assembly& assembly, std::function<void(const RefusedMove&)> refuse)
    : assembly_(assembly),
      rules_(assembly),
      refuse_(std::move(refuse)),
      straight_(assembly.kinematics->words_are_joints()),
      separable_(straight_ && !assembly.map->has_pose() && !assembly.map->has_joint()) {
  const auto count = static_cast<Eigen::Index>(assembly.plan_joints.size());
  lowest_joint_ = highest_joint_ = JointVec::Zero(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const JointLimit& limit = assembly.plan_joints[static_cast<std::size_t>(k)].limit;
    lowest_joint_[k] = limit.min;
    highest_joint_[k] = limit.max;
  }
}

void RangeCheck::move(const ProgramMove& move) {
  ++moves;
  if (move.source.line == 0) approach.push_back(move.to);
  const bool arc = move.kind == ProgramMove::Kind::kArc;
  if (path_norm(move.to - move.from) == 0 && !arc) return;
  const std::string refusal = rules_.refusal_of(move);
  if (refusal != std::exchange(refused_by_rule_, refusal) && !refusal.empty())
    refuse_({move.source.line, 0, refusal});
  const bool bends = arc || move.context.rtcp || !straight_;
  if (!bends) return judge_end(move);
  const PathPiece piece =
      arc ? make_arc(move.from, move.to, move.arc_centre, move.arc_axis, move.arc_sweep_rad)
          : make_line(move.from, move.to);
  const int least = arc ? kArcSamplesMin : piece.length > kShortMove_mm ? 2 : 1;
  const int parts = std::clamp(static_cast<int>(piece.length / kSampleStep_mm), least, kSamplesMax);
  const double step = piece.length / parts;
  int known = 0;
  turned_.fill(-piece.length);
  for (int i = parts > 1 ? 0 : 1; i <= parts; ++i) {
    std::rotate(near_.begin(), near_.begin() + 1, near_.end());
    known = judge(move, piece.at(step * i), near_[2]) ? known + 1 : 0;
    if (known >= 3) judge_turns(move, piece, step * (i - 1), step);
  }
}

void RangeCheck::stand_at(const JointVec& q) {
  for (std::size_t i = 0; i < assembly_.plan_joints.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    stands_outside_ |= q[k] < lowest_joint_[k] || q[k] > highest_joint_[k];
    lowest_joint_[k] = std::min(lowest_joint_[k], q[k]);
    highest_joint_[k] = std::max(highest_joint_[k], q[k]);
  }
}

// What has come in does not go out again.
void RangeCheck::come_in(const JointVec& q) {
  if (!stands_outside_) return;
  stands_outside_ = false;
  for (std::size_t i = 0; i < assembly_.plan_joints.size(); ++i) {
    const JointLimit& limit = assembly_.plan_joints[i].limit;
    const auto k = static_cast<Eigen::Index>(i);
    lowest_joint_[k] = std::min(limit.min, std::max(lowest_joint_[k], q[k]));
    highest_joint_[k] = std::max(limit.max, std::min(highest_joint_[k], q[k]));
    stands_outside_ |= lowest_joint_[k] < limit.min || highest_joint_[k] > limit.max;
  }
}

// Between three places, the middle one at s: where a parabola has a joint turn back near its limit, the place
// of the turn is looked for and judged.
void RangeCheck::judge_turns(const ProgramMove& move, const PathPiece& piece, double s, double step) {
  for (std::size_t i = 0; i < assembly_.plan_joints.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double before = near_[0][k], here = near_[1][k], after = near_[2][k];
    const double bend = (before - 2 * here + after) / 2, slope = (after - before) / 2;
    if (std::abs(slope) > 2 * std::abs(bend) || bend == 0) continue;
    const double turn = here - slope * slope / (4 * bend), slack = std::abs(bend) + std::abs(slope);
    const double side = bend < 0 ? 1 : -1;
    const double end = side * (side > 0 ? highest_joint_[k] : lowest_joint_[k]);
    const bool told =
        side * here > end + kRounding || std::max(side * before, side * after) > end + kRounding;
    if (side * turn + slack < end || told) continue;
    double from = s - step, to = s + step;
    const auto out_at = [&](double at) {
      JointVec q;
      return assembly_.map->map(piece.at(at), move.context, q) == KinStatus::kOk ? side * q[k] : -1e300;
    };
    for (int n = 0; n < kTurnHalvings; ++n) {
      const double third = (to - from) / 3;
      if (out_at(from + third) < out_at(to - third))
        from += third;
      else
        to -= third;
    }
    const double at = (from + to) / 2;
    if (std::abs(at - std::exchange(turned_[i], at)) < kSameTurn * step) continue;  // of the places before
    JointVec q;
    judge(move, piece.at(at), q);
  }
}

// Most ends lie between others that were good.
void RangeCheck::judge_end(const ProgramMove& move) {
  if (has_box_ && !stands_outside_ && box_tool_ == move.context.tool_offset &&
      (move.to.array() >= lowest_.array()).all() && (move.to.array() <= highest_.array()).all()) {
    outside_ = 0;
    unreachable_ = false;
    return;
  }
  JointVec q;
  judge(move, move.to, q);
  if (!separable_ || outside_ != 0 || unreachable_ || stands_outside_) return;
  const bool widens = has_box_ && box_tool_ == move.context.tool_offset;
  lowest_ = widens ? Words(lowest_.cwiseMin(move.to)) : move.to;
  highest_ = widens ? Words(highest_.cwiseMax(move.to)) : move.to;
  box_tool_ = move.context.tool_offset;
  has_box_ = true;
}

bool RangeCheck::judge(const ProgramMove& move, const Words& y, JointVec& q) {
  const KinStatus status = assembly_.map->map(y, move.context, q);
  const bool told = unreachable_;
  unreachable_ = status != KinStatus::kOk;
  if (unreachable_ && !told)
    refuse_({move.source.line, 0,
             fmt::format("the machine cannot get there ({}): X{:.4f} Y{:.4f} Z{:.4f}; {}", to_string(status),
                         y[0], y[1], y[2], way_out(move, y))});
  if (unreachable_) return false;
  for (std::size_t i = 0; i < assembly_.plan_joints.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double value = q[k];
    const bool inside = value >= lowest_joint_[k] - kRounding && value <= highest_joint_[k] + kRounding;
    const unsigned bit = 1U << i;
    const bool known = (outside_ & bit) != 0;
    outside_ = inside ? outside_ & ~bit : outside_ | bit;
    if (!inside && !known) outside(move, i, value);
  }
  if (outside_ == 0) come_in(q);
  return true;
}

// A machine that gets there without its correction of geometry is kept from it by that correction's own
// limit.
std::string RangeCheck::way_out(const ProgramMove& move, const Words& y) const {
  MapContext nominal = move.context;
  nominal.corrections_off |= kGeometricBit;
  JointVec q;
  if (!assembly_.map->pose(move.context.corrections_off) ||
      assembly_.map->map(y, nominal, q) != KinStatus::kOk)
    return "move the work offset or the part";
  return "[corrections.geometric] would move a joint by more than its limit_mm or limit_deg; check its "
         "numbers";
}

void RangeCheck::outside(const ProgramMove& move, std::size_t i, double value) {
  const Joint& joint = assembly_.plan_joints[i];
  const bool rotary = joint.kind == JointKind::kRotary;
  const double unit = rotary ? kDegPerRad : 1.0;
  refuse_(
      {move.source.line, !straight_ || move.context.rtcp ? char{0} : letter_of(i),
       fmt::format("joint {} would go to {:.4f} {}, outside its range {:g} to {:g}; move the work offset or "
                   "the part, or change the program",
                   joint.name, value * unit, rotary ? "deg" : "mm", joint.limit.min * unit,
                   joint.limit.max * unit)});
}

// The word that moves this joint of a serial machine: the one whose change changes it.
char RangeCheck::letter_of(std::size_t joint) const {
  for (int k = 0; k < 6; ++k) {
    Words words = Words::Zero();
    JointVec at_zero, moved;
    if (assembly_.kinematics->joints_from_words(words, at_zero) != KinStatus::kOk) return 0;
    words[k] = 1;
    if (assembly_.kinematics->joints_from_words(words, moved) != KinStatus::kOk) continue;
    const auto i = static_cast<Eigen::Index>(joint);
    if (at_zero[i] != moved[i]) return kWordLetters[k];
  }
  return 0;
}

}  // namespace trn

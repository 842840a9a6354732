#include "app/session/range_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/path.h"
#include "core/ports.h"
#include "core/units.h"

namespace trn {

namespace {

constexpr double kRounding = 1e-9;
constexpr double kSampleStep_mm = 5;
constexpr int kSamplesMax = 200;

}  // namespace

RangeCheck::RangeCheck(const Assembly& assembly, std::function<void(const RefusedMove&)> refuse)
    : assembly_(assembly),
      refuse_(std::move(refuse)),
      straight_(assembly.kinematics->words_are_joints()),
      separable_(straight_ && !assembly.map->has_pose() && !assembly.map->has_joint()) {}

void RangeCheck::move(const ProgramMove& move) {
  ++moves;
  if (move.source.line == 0) approach.push_back(move.to);
  const bool arc = move.kind == ProgramMove::Kind::kArc;
  if (path_norm(move.to - move.from) == 0 && !arc) return;
  const bool bends = arc || move.context.rtcp || !straight_;
  if (!bends) return judge_end(move);
  const PathPiece piece =
      arc ? make_arc(move.from, move.to, move.arc_centre, move.arc_axis, move.arc_sweep_rad)
          : make_line(move.from, move.to);
  const int parts = std::clamp(static_cast<int>(piece.length / kSampleStep_mm), 1, kSamplesMax);
  for (int i = 1; i <= parts; ++i) judge(move, piece.at(piece.length * i / parts));
}

// Most ends lie between others that were good.
void RangeCheck::judge_end(const ProgramMove& move) {
  if (has_box_ && box_tool_ == move.context.tool_offset && (move.to.array() >= lowest_.array()).all() &&
      (move.to.array() <= highest_.array()).all()) {
    outside_ = 0;
    unreachable_ = false;
    return;
  }
  judge(move, move.to);
  if (!separable_ || outside_ != 0 || unreachable_) return;
  const bool widens = has_box_ && box_tool_ == move.context.tool_offset;
  lowest_ = widens ? Words(lowest_.cwiseMin(move.to)) : move.to;
  highest_ = widens ? Words(highest_.cwiseMax(move.to)) : move.to;
  box_tool_ = move.context.tool_offset;
  has_box_ = true;
}

void RangeCheck::judge(const ProgramMove& move, const Words& y) {
  JointVec q;
  const KinStatus status = assembly_.map->map(y, move.context, q);
  const bool told = unreachable_;
  unreachable_ = status != KinStatus::kOk;
  if (unreachable_ && !told)
    refuse_({move.source.line, 0,
             fmt::format("the machine cannot get there ({}): X{:.4f} Y{:.4f} Z{:.4f}; {}", to_string(status),
                         y[0], y[1], y[2], way_out(move, y))});
  if (unreachable_) return;
  for (std::size_t i = 0; i < assembly_.plan_joints.size(); ++i) {
    const JointLimit& limit = assembly_.plan_joints[i].limit;
    const double value = q[static_cast<Eigen::Index>(i)];
    const bool inside = value >= limit.min - kRounding && value <= limit.max + kRounding;
    const unsigned bit = 1U << i;
    const bool known = (outside_ & bit) != 0;
    outside_ = inside ? outside_ & ~bit : outside_ | bit;
    if (!inside && !known) outside(move, i, value);
  }
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

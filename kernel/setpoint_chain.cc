#include "kernel/setpoint_chain.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "compensation/micromill/deflection_correction.h"
#include "core/check.h"

namespace trn {

namespace {

constexpr double kJumpMaxMm = 0.2, kJumpMaxRad = 0.001;  // far more than a tilt times a change of tools

double limit_on(const SetpointBudget& budget, const SetpointCorrection& correction, std::size_t joint,
                JointKind kind) {
  if ((correction.joint_mask() >> joint & 1u) == 0) return 0;
  return kind == JointKind::kRotary ? budget.limit_rad : budget.limit_mm;
}

}  // namespace

void SetpointChain::append(const SetpointBudget& budget, std::unique_ptr<SetpointCorrection> correction) {
  if (links_.size() == kMax) throw std::logic_error("too many corrections in the chain");
  const auto n = static_cast<Eigen::Index>(joints_.size());
  Link link;
  link.budget = budget;
  link.correction = std::move(correction);
  link.enabled = budget.enabled;
  link.wanted = link.offset = sum_ = JointVec::Zero(n);
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const JointLimit& l = joints_[i].limit;
    const double limit = limit_on(budget, *link.correction, i, joints_[i].kind), share = budget.reserve;
    link.limits.push_back(limit);
    link.filters.emplace_back();
    if (limit <= 0) continue;
    // Of an offset that follows the axis the switch is filtered, a value of 0 to 1 that scales the offset.
    const double unit = link.correction->slope_max() > 0 ? limit : 1;
    link.filters.back() = OffsetFilter(limit / unit, share * l.velocity / unit, share * l.acceleration / unit,
                                       share * l.jerk / unit, period_s_);
  }
  links_.push_back(std::move(link));
}

void SetpointChain::append_deflection(const SetpointBudget& budget,
                                      std::unique_ptr<DeflectionCorrection> correction) {
  deflection_ = correction.get();
  deflection_link_ = size();
  append(budget, std::move(correction));
}

Eigen::Vector2d SetpointChain::deflection_shift_mm() const TRN_RT {
  if (!deflection_) return Eigen::Vector2d::Zero();
  return offset(deflection_link_).head<2>();
}

void SetpointChain::take_up_jumps(double reserve) {
  sum_.setZero(static_cast<Eigen::Index>(joints_.size()));
  jump_reserve_ = reserve;
  for (const Joint& joint : joints_) {
    const JointLimit& l = joint.limit;
    jumps_.emplace_back(joint.kind == JointKind::kRotary ? kJumpMaxRad : kJumpMaxMm, reserve * l.velocity,
                        reserve * l.acceleration, reserve * l.jerk, period_s_);
  }
}

bool SetpointChain::take_up(const JointVec& jump) TRN_RT {
  TRN_CHECK(static_cast<std::size_t>(jump.size()) == joints_.size());
  for (std::size_t i = 0; i < jumps_.size(); ++i) {
    const double largest = joints_[i].kind == JointKind::kRotary ? kJumpMaxRad : kJumpMaxMm;
    const double jump_i = jump[static_cast<Eigen::Index>(i)];
    if (!(std::abs(jumps_[i].value() + jump_i) <= largest)) return false;
  }
  for (std::size_t i = 0; i < jumps_.size(); ++i) jumps_[i].shift(jump[static_cast<Eigen::Index>(i)]);
  return true;
}

Joints SetpointChain::plan_joints() const {
  Joints out = joints_;
  for (std::size_t i = 0; i < out.size(); ++i) {
    double reserve = jump_reserve_, range = 0;
    for (const Link& link : links_) {
      if (link.limits[i] <= 0) continue;
      reserve += link.budget.reserve + link.correction->slope_max();
      range += link.limits[i];
    }
    JointLimit& limit = out[i].limit;
    limit.min += range;
    limit.max -= range;
    for (double* rate : {&limit.velocity, &limit.acceleration, &limit.jerk}) *rate *= 1 - reserve;
  }
  return out;
}

void SetpointChain::enable(int i, bool on) TRN_RT {
  Link& link = links_[static_cast<std::size_t>(i)];
  TRN_CHECK(i >= 0 && i < size());
  link.enabled = on;
  link.switched = false;
}

double SetpointChain::switch_by_program(int bits, bool on) TRN_RT {
  constexpr double kFadedAfter = 15;  // time constants of the three low passes
  double tau_s = 0;
  for (Link& link : links_) {
    if ((link.budget.bit & bits) == 0) continue;
    const bool was_on = link.on();
    link.switched = true;
    link.switched_on = on;
    if (was_on == on) continue;
    for (const OffsetFilter& filter : link.filters) tau_s = std::max(tau_s, filter.time_constant_s());
  }
  return kFadedAfter * tau_s;
}

void SetpointChain::forget_program() TRN_RT {
  for (Link& link : links_) link.switched = false;
}

void SetpointChain::step(const CorrectionInput& input) TRN_RT {
  sum_.setZero();
  TRN_CHECK(static_cast<std::size_t>(input.q.size()) == joints_.size());
  if (board_) heard_ = board_->listen();
  for (Link& link : links_) {
    step(link, input);
    sum_ += link.offset;
  }
  for (std::size_t i = 0; i < jumps_.size(); ++i) sum_[static_cast<Eigen::Index>(i)] += jumps_[i].step(0);
}

void SetpointChain::step(Link& link, const CorrectionInput& input) TRN_RT {
  const bool follows = link.correction->slope_max() > 0;
  link.correction->wanted(input, link.wanted);
  for (std::size_t i = 0; i < link.limits.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double limit = link.limits[i], wanted = link.wanted[k];
    if (limit <= 0) continue;
    if (!follows)
      link.offset[k] = link.filters[i].step(link.on() ? wanted : 0);
    else if (std::isfinite(wanted))
      link.offset[k] = link.filters[i].step(link.on() ? 1 : 0) * std::clamp(wanted, -limit, limit);
    TRN_CHECK(std::abs(link.offset[k]) <= limit * (1 + 1e-9));
  }
}

}  // namespace trn

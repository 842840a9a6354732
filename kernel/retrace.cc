#include "kernel/retrace.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/check.h"
#include "core/motion.h"

namespace trn {

namespace {

constexpr PlanShares kRetraceShares{0.9, 0.8};  // of the limits; the rest stops the motion at any moment
constexpr double kNoRetrace_s = 1e-9;           // of plan time
constexpr int kNewtonSteps = 16;                // as many are needed from rest with jerk; elsewhere four do
constexpr double kMet_mm = 1e-9;

std::size_t segment_index(int segment) TRN_RT { return static_cast<std::size_t>(segment); }

double length_mm(const TimeSegment& segment, double from_s, double to_s) TRN_RT {
  return std::abs(segment.s_at(to_s) - segment.s_at(from_s));
}

// The time, seen from `from_s` towards `to_s`, at which this length of the segment is gone: Newton's method
// on the cubic s(t), with a bisection where a step would leave the part that is left.
double time_at(const TimeSegment& segment, double from_s, double to_s, double gone_mm) TRN_RT {
  const double sense = to_s < from_s ? -1 : 1, goal_mm = segment.s_at(from_s) + sense * gone_mm;
  double low_s = std::min(from_s, to_s), high_s = std::max(from_s, to_s), t = (low_s + high_s) / 2;
  for (int i = 0; i < kNewtonSteps; ++i) {
    const double beyond_mm = segment.s_at(t) - goal_mm;
    if (std::abs(beyond_mm) <= kMet_mm) break;
    (beyond_mm > 0 ? high_s : low_s) = t;
    const double speed = segment.v_at(t), next = t - beyond_mm / speed;
    t = speed > 0 && next > low_s && next < high_s ? next : (low_s + high_s) / 2;
  }
  return t;
}

}  // namespace

// A joint that the plan moves by v, a, j moves by r v, r^2 a + r' v and r^3 j + 3 r r' a + r'' v. With r at
// most a half that is a quarter of A and an eighth of J, and what r' and r'' take.
Retrace::Retrace(const Joints& joints, double period_s, MotionQueue& queue, Interpolator& interpolator)
    : queue_(queue),
      interpolator_(interpolator),
      time_scale_(joints, kRetraceShares, period_s),
      slope_max_(std::numeric_limits<double>::max()),
      bend_max_(slope_max_),
      period_s_(period_s) {
  constexpr double r = kRateMax;
  constexpr double kSpareA = kRetraceShares.acceleration - r * r,
                   kSpareJ = (kRetraceShares.jerk - r * r * r) / 2;
  for (const Joint& joint : joints) {
    const JointLimit& limit = joint.limit;
    slope_max_ = std::min({slope_max_, kSpareA * limit.acceleration / limit.velocity,
                           kSpareJ * limit.jerk / (3 * r * limit.acceleration)});
    bend_max_ = std::min(bend_max_, kSpareJ * limit.jerk / limit.velocity);
  }
}

const MotionBlock& Retrace::block(std::uint64_t number) const TRN_RT {
  const MotionBlock* const found = queue_.kept(number);
  TRN_CHECK(found != nullptr && found->segment_count > 0);
  return *found;
}

bool Retrace::at_hold() const TRN_RT {
  return here_.block == hold_.block && here_.segment == hold_.segment && here_.time_s == hold_.time_s;
}

void Retrace::go(double way_mm) TRN_RT {
  if (way_mm == 0 || moves()) return;
  if (!away_) {
    held_ = interpolator_.stand();
    hold_ = here_ = interpolator_.place();
    behind_mm_ = 0;
  }
  away_ = true;
  at_end_ = way_mm > 0 && at_hold();
  if (at_end_) return;
  sense_ = way_mm < 0 ? -1 : 1;
  left_mm_ = std::abs(way_mm);
  seen_ = here_;
  seen_s_ = 0;
  stops_ = false;
  state_ = State::kLooks;
}

bool Retrace::step(double rate) TRN_RT {
  TRN_CHECK(moves());
  rate_ = 0;
  if (state_ == State::kLooks) {
    look();
    return false;
  }
  time_scale_.set_target(stops_ ? 0 : rate);
  time_s_ += time_scale_.step();
  const double gone_s = curve_.at(time_s_);
  rate_ = sense_ * (gone_s - gone_s_) / period_s_;
  walk(gone_s - gone_s_);
  gone_s_ = gone_s;
  const bool arrived = time_s_ >= curve_.duration_s();
  if (arrived) here_ = seen_;
  if (arrived && at_hold())
    interpolator_.return_to(held_);
  else
    interpolator_.go_to(here_, block(here_.block));
  at_end_ = at_end_ && (arrived || !stops_);
  if (arrived || (stops_ && time_scale_.at_target())) come_to_rest();
  return true;
}

// How far the wish leads, a few blocks in a period.
void Retrace::look() TRN_RT {
  bool goes_on = !stops_;
  for (int blocks = 0; blocks < kBlocksPerTick && goes_on; ++blocks) {
    if (sense_ < 0 && seen_.segment == 0 && seen_.time_s == 0) {
      goes_on = leads_back_from(seen_.block);
      at_end_ = !goes_on;
      if (!goes_on) break;
      --seen_.block;
      seen_.segment = block(seen_.block).segment_count;
    }
    goes_on = sense_ < 0 ? look_back(block(seen_.block)) : look_forward(block(seen_.block));
  }
  if (!goes_on) set_off();
}

// What has begun there is not undone.
bool Retrace::leads_back_from(std::uint64_t number) const TRN_RT {
  const MotionBlock* const before = number > 0 ? queue_.kept(number - 1) : nullptr;
  if (!before || before->segment_count == 0 || !(before->context == interpolator_.context())) return false;
  const bool begun = number != hold_.block || held_.begun;
  return !begun || !block(number).outputs.any();
}

// To the beginning of the block. False: the wish is met.
bool Retrace::look_back(const MotionBlock& block) TRN_RT {
  while (seen_.segment > 0 || seen_.time_s > 0) {
    if (seen_.segment == block.segment_count || seen_.time_s == 0) {
      --seen_.segment;
      seen_.time_s = block.segments[segment_index(seen_.segment)].duration_s;
    }
    if (reaches(block.segments[segment_index(seen_.segment)], seen_.time_s, 0)) return false;
  }
  return true;
}

// To its end. False: the wish is met, or the place of the hold.
bool Retrace::look_forward(const MotionBlock& block) TRN_RT {
  for (; seen_.segment < block.segment_count; ++seen_.segment, seen_.time_s = 0) {
    const TimeSegment& segment = block.segments[segment_index(seen_.segment)];
    const bool last = seen_.block == hold_.block && seen_.segment == hold_.segment;
    if (reaches(segment, seen_.time_s, last ? hold_.time_s : segment.duration_s)) return false;
    if (last) return meets_hold();
  }
  if (seen_.block + 1 == hold_.block && hold_.segment == 0 && hold_.time_s == 0) return meets_hold();
  seen_ = {seen_.block + 1, 0, 0};
  return true;
}

bool Retrace::meets_hold() TRN_RT {
  seen_ = hold_;
  at_end_ = true;
  return false;
}

// Whether the rest of the wish ends within this part of a segment; looks on from there, or from its end.
bool Retrace::reaches(const TimeSegment& segment, double from_s, double to_s) TRN_RT {
  const double whole_mm = length_mm(segment, from_s, to_s);
  const bool met = whole_mm >= left_mm_;
  const double at_s = met ? time_at(segment, from_s, to_s, left_mm_) : to_s;
  left_mm_ = met ? 0 : left_mm_ - whole_mm;
  seen_s_ += std::abs(at_s - from_s);
  seen_.time_s = at_s;
  return met;
}

void Retrace::set_off() TRN_RT {
  if (stops_ || seen_s_ < kNoRetrace_s) return come_to_rest();
  curve_ = SCurve(seen_s_, kRateMax, slope_max_, bend_max_);
  time_s_ = gone_s_ = 0;
  time_scale_.set_target(1);
  time_scale_.restart();
  state_ = State::kMoves;
}

// To the neighbour of this segment where it ends. False: there is none to go to.
bool Retrace::enter_next(bool back) TRN_RT {
  const bool inside_first = here_.block == seen_.block && here_.segment == seen_.segment;
  const std::uint64_t next = here_.block + 1;
  if (inside_first || (!back && next == seen_.block && seen_.segment == 0 && seen_.time_s == 0 &&
                       here_.segment + 1 == block(here_.block).segment_count))
    return false;
  if (back && here_.segment == 0) here_ = {here_.block - 1, block(here_.block - 1).segment_count, 0};
  if (back) {
    --here_.segment;
    here_.time_s = block(here_.block).segments[segment_index(here_.segment)].duration_s;
  } else if (here_.segment + 1 == block(here_.block).segment_count) {
    here_ = {next, 0, 0};
  } else {
    ++here_.segment;
    here_.time_s = 0;
  }
  return true;
}

// Along the blocks; within one period there are only a few.
void Retrace::walk(double plan_time_s) TRN_RT {
  const bool back = sense_ < 0;
  double left_s = plan_time_s;
  for (int i = 0; i < kBlocksPerTick * MotionBlock::kMaxSegments && left_s > 0; ++i) {
    const bool from_front = here_.segment == 0 && here_.time_s == 0;
    if (back && from_front && !enter_next(true)) return;
    const TimeSegment& segment = block(here_.block).segments[segment_index(here_.segment)];
    const double room_s = back ? here_.time_s : segment.duration_s - here_.time_s;
    const double gone_s = std::min(left_s, room_s);
    const double to_s = back ? here_.time_s - gone_s : here_.time_s + gone_s;
    behind_mm_ -= sense_ * length_mm(segment, here_.time_s, to_s);
    here_.time_s = to_s;
    left_s -= gone_s;
    if (left_s > 0 && !enter_next(back)) return;
  }
}

void Retrace::come_to_rest() TRN_RT {
  const bool moved = state_ == State::kMoves;
  state_ = State::kStands;
  if (!moved) return;
  queue_.go_to(here_.block, interpolator_.begun());
  if (at_hold()) behind_mm_ = 0;  // without the rounding of the sum
}

void Retrace::forget() TRN_RT {
  state_ = State::kStands;
  away_ = at_end_ = stops_ = false;
  rate_ = behind_mm_ = 0;
}

}  // namespace trn

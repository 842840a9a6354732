#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/path.h"
#include "interp/move.h"

// How long every programmed block was driven, measured on the motion alone and held against the program.
namespace trn::test {

/// One programmed move, or some that are too short to be told apart.
struct BlockTime {
  std::uint32_t line = 0;
  double programmed_s = 0;    ///< what its feed asks for; 0: a rapid move
  double driven_s = 0;        ///< from its border to the next
  double length = 0;          ///< of the programmed way, in the path norm
  double driven_mm = 0;       ///< of the tip's way that was driven
  double worst = 0;           ///< worst ratio of a joint's velocity, acceleration or jerk to its limit
  double tolerance = 0;       ///< in the path norm
  bool inverse_time = false;  ///< G93
  double feed_mm_s = 0;       ///< G94, G95: the tip's; 0: none
};

/// Feed it the moves of a program in order and the place of the motion in every period, then read `blocks`.
///
/// The border between two blocks is the plane through the programmed point that halves the angle between
/// them, in the path norm (mm and degrees): the middle of a blend, and of any curve that keeps to both sides
/// alike. A block without motion of its own, a dwell or an event, belongs to the block before it.
class BlockClock {
 public:
  explicit BlockClock(double period_s) : period_s_(period_s) {}

  void programmed(const ProgramMove& move) {
    Leg leg;
    leg.line = move.source.line;
    leg.end = move.to;
    leg.context = move.context;
    const Words way = move.to - move.from;
    leg.length = path_norm(way);
    leg.leaves = leg.arrives = way;
    double tip_mm = way.head<3>().norm();
    if (move.kind == ProgramMove::Kind::kArc) {
      const Vec3 r0 = across(move, move.from), r1 = across(move, move.to);
      const Vec3 rise = move.arc_axis * move.arc_axis.dot(Vec3(way.head<3>()));
      leg.leaves.head<3>() = move.arc_sweep_rad * move.arc_axis.cross(r0) + rise;
      leg.arrives.head<3>() = move.arc_sweep_rad * move.arc_axis.cross(r1) + rise;
      tip_mm = std::hypot(r0.norm() * move.arc_sweep_rad, rise.norm());
      leg.length = std::hypot(tip_mm, kMmPerRadInPath * way.tail<3>().norm());
    }
    if (leg.length < 1e-9) return;
    leg.time.inverse_time = move.duration_s > 0;
    const double rotary_s = way.tail<3>().norm() / move.feed.rotary_rad_s;
    const double feed_s = std::max(tip_mm / move.feed.tip_mm_s, rotary_s);
    leg.time.programmed_s = leg.time.inverse_time ? move.duration_s : feed_s;
    if (std::isfinite(move.feed.tip_mm_s) && tip_mm > 1e-9) leg.time.feed_mm_s = move.feed.tip_mm_s;
    leg.time.line = leg.line;
    leg.time.length = leg.length;
    if (move.mode == PathMode::kContinuous)
      leg.time.tolerance = std::hypot(move.tolerance_mm, kMmPerRadInPath * move.tolerance_rad);
    legs_.push_back(leg);
  }

  /// The place at the end of a period, as a move's words; and the worst ratio of a joint's velocity,
  /// acceleration or jerk in it to its limit.
  void sample(const Words& y, double worst) {
    if (here_ >= legs_.size()) return;
    const bool moves = begun_ && path_norm(y - y_last_) > 0;
    if (!begun_) y_last_ = y;
    begun_ = true;
    double from = 0;  // of this period
    bool crossed = true;
    while (crossed && here_ < legs_.size()) {
      Leg& leg = legs_[here_];
      double at = 1;
      crossed = here_ + 1 < legs_.size() && crosses(leg, legs_[here_ + 1], y, at);
      at = std::max(at, from);
      leg.time.driven_s += (crossed || moves ? at - from : 0) * period_s_;
      leg.time.driven_mm += (at - from) * (y - y_last_).head<3>().norm();
      leg.time.worst = std::max(leg.time.worst, worst);
      travelled_ += (at - from) * path_norm(y - y_last_);
      if (!crossed) break;
      from = at;
      travelled_ = 0;
      ++here_;
    }
    y_last_ = y;
  }

  /// Moves in order; such as are shorter than `apart` tolerances count as one with those that follow.
  std::vector<BlockTime> blocks(double apart = 4) const {
    std::vector<BlockTime> out;
    bool open = false;
    for (const Leg& leg : legs_) {
      if (!open) {
        out.push_back(leg.time);
      } else {
        BlockTime& sum = out.back();
        sum.inverse_time = sum.inverse_time || leg.time.inverse_time;
        sum.programmed_s += leg.time.programmed_s;
        sum.driven_s += leg.time.driven_s;
        sum.length += leg.time.length;
        sum.driven_mm += leg.time.driven_mm;
        sum.worst = std::max(sum.worst, leg.time.worst);
        sum.tolerance = std::max(sum.tolerance, leg.time.tolerance);
        sum.feed_mm_s = std::max(sum.feed_mm_s, leg.time.feed_mm_s);
      }
      open = out.back().length < apart * out.back().tolerance;
    }
    return out;
  }

  /// All borders were passed.
  bool complete() const { return legs_.empty() || here_ + 1 == legs_.size(); }

 private:
  struct Leg {
    std::uint32_t line = 0;
    Words end, leaves, arrives;  ///< tangents of any length
    MapContext context;
    double length = 0;
    BlockTime time;
  };

  static Vec3 across(const ProgramMove& move, const Words& at) {
    const Vec3 r = at.head<3>() - move.arc_centre;
    return r - move.arc_axis * move.arc_axis.dot(r);
  }
  static double dot(const Words& a, const Words& b) {
    return a.head<3>().dot(b.head<3>()) + kMmPerRadInPath * kMmPerRadInPath * a.tail<3>().dot(b.tail<3>());
  }

  // `at`: the share of the period.
  bool crosses(const Leg& leg, const Leg& next, const Words& y, double& at) const {
    if (travelled_ + path_norm(y - y_last_) < leg.length / 2 - 4 * leg.time.tolerance) return false;
    const Words in = leg.arrives / path_norm(leg.arrives), out = next.leaves / path_norm(next.leaves);
    Words across = in + out;
    if (path_norm(across) < 0.2 || !(leg.context == next.context)) across = in;
    const double before = dot(y_last_ - leg.end, across), now = dot(y - leg.end, across);
    const double rounding = 1e-9 * (1 + path_norm(y));
    if (now < -rounding) return false;
    at = before < now ? std::clamp(-before / (now - before), 0.0, 1.0) : 0;
    return true;
  }

  double period_s_;
  std::vector<Leg> legs_;
  std::size_t here_ = 0;
  bool begun_ = false;
  Words y_last_ = Words::Zero();
  double travelled_ = 0;
};

}  // namespace trn::test

#pragma once

#include <array>
#include <cstddef>

#include "core/motion.h"

namespace trn {

/// The operator's overrides as they act on the motion, 1 = as programmed.
struct OverrideShares {
  double feed = 1, rapid = 1, adaptive = 1, spindle = 1;
};

/// Time of planned motion and dwells, s at 100 %, apart by what may change it. Plain data.
class PlanTime {
 public:
  /// Of these overrides the time of a block depends.
  struct Kind {
    bool rapid = false, feed = false, adaptive = false;
    bool spindle = false;  ///< G95: the feed follows the spindle's override
  };
  static constexpr std::size_t kKinds = 9;
  static Kind kind_of(const MotionBlock& block);

  PlanTime() = default;
  PlanTime(const std::array<double, kKinds>& shares_s, double rapid_runs)
      : shares_s_(shares_s), rapid_runs_(rapid_runs) {}

  void add(const MotionBlock& block);
  void add(Kind kind, double duration_s) {
    shares_s_[index(kind)] += duration_s;
    if (kind.rapid && !in_rapid_run_) ++rapid_runs_;
    in_rapid_run_ = kind.rapid;
  }
  PlanTime operator-(const PlanTime& other) const;
  /// For who sends it elsewhere.
  const std::array<double, kKinds>& shares_s() const { return shares_s_; }
  double total_s() const;
  /// Of rapid moves, and how often they begin after something else.
  double rapid_s() const { return shares_s_[kKinds - 1]; }
  double rapid_runs() const { return rapid_runs_; }
  /// How long it takes with these overrides; infinite where one of them is 0.
  double real_s(const OverrideShares& shares) const;
  /// The rate that these overrides ask of a block of this kind.
  static double rate(Kind kind, const OverrideShares& shares);

 private:
  static std::size_t index(Kind kind) {
    return kind.rapid ? kKinds - 1
                      : (kind.feed ? 1u : 0u) + (kind.adaptive ? 2u : 0u) + (kind.spindle ? 4u : 0u);
  }
  std::array<double, kKinds> shares_s_{};  ///< by `index`
  double rapid_runs_ = 0;
  bool in_rapid_run_ = false;  ///< what was added last is rapid
};

}  // namespace trn

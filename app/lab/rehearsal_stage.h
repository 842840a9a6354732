#pragma once

#include <functional>
#include <memory>
#include <string>

#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/ports.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"

namespace trn {

/// A whole machine whose field is emulated, driven tick by tick: what rehearsals of trouble have in common.
/// Counts are periods of the tick.
class RehearsalStage {
 public:
  virtual ~RehearsalStage() = default;

  const CycleReport& report() const { return cycle_->last_report(); }
  int periods(double time_s) const;
  void tick(int count = 1);
  /// Periods until `done`; -1 if it does not come within `limit`.
  int until(const std::function<bool()>& done, int limit);
  bool enabled() const { return report().drives == DriveState::kEnabled; }
  bool ready() const { return enabled() && report().fault == Fault::kOk; }
  bool homed() const;
  /// Homes if that is wanted, then waits for rest; std::runtime_error when the machine does not get there.
  void home();
  /// Plans the program to its end and starts it.
  void start_program(const std::string& text);
  /// Way of the joint that went farthest, mm or rad.
  double moves_in(int count);
  /// Periods from now until nothing moves more than `still` a period; the motion may also end as planned.
  int wait_for_rest(double still, const std::function<void()>& each_period = {});

 protected:
  explicit RehearsalStage(Assembly assembly) : assembly_(std::move(assembly)), queue_(1 << 12) {}
  RehearsalStage(const RehearsalStage&) = delete;

  virtual void one_period() = 0;
  virtual JointVec places() const = 0;  ///< of the joints, as the rehearsal judges rest
  virtual std::string explain() const = 0;
  void require(bool good) const;

  Assembly assembly_;
  MotionQueue queue_;
  std::unique_ptr<Cycle> cycle_;
};

}  // namespace trn

#pragma once

#include <functional>
#include <memory>
#include <string>

#include "app/session/assembly.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"

namespace trn {

/// A machine that is being commissioned: its tick runs, and one asks it to move. Made anew whenever the
/// config has changed.
class CommissionMachine {
 public:
  virtual ~CommissionMachine() = default;
  CommissionMachine(const CommissionMachine&) = delete;

  /// So much time of the machine passes.
  virtual void wait(double time_s) = 0;
  /// The last period's.
  virtual CycleReport report() = 0;
  /// Latest wake-up and longest tick that were seen, us; 0: no clock here that could be late.
  virtual double latest_us() const { return 0; }

  void post(const RtCommand& command) { cycle_->post(command); }
  Assembly& assembly() { return assembly_; }
  /// Waits until `done`, at most so long; true when it came.
  bool until(const std::function<bool(const CycleReport&)>& done, double time_s);

 protected:
  explicit CommissionMachine(Assembly assembly) : assembly_(std::move(assembly)), queue_(64) {}

  Assembly assembly_;
  MotionQueue queue_;
  std::unique_ptr<Cycle> cycle_;
};

/// Who stands at the machine.
class CommissionOperator {
 public:
  virtual ~CommissionOperator() = default;
  /// May the machine move now, as `text` says?
  virtual bool agrees(const std::string& text) = 0;
  /// Joint `joint` has moved: by how much, mm or degrees, and never mind the direction?
  virtual double measured(const std::string& text, int joint) = 0;
  /// Did the tool go, or turn, the positive way of `word` seen from the work?
  virtual bool went_positive(const std::string& text, int word) = 0;
  /// What is happening, and what came out.
  virtual void tell(const std::string& text) = 0;
};

}  // namespace trn

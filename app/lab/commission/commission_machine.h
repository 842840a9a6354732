#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "app/session/assembly.h"
#include "hal/can/sdo_talk.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"

namespace trn {

/// Who answers on a bus.
struct ScannedBus {
  std::string interface;
  std::vector<FoundNode> nodes;
};

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
  /// Latest wake-up and longest tick of the next seconds, us.
  virtual double latest_us(double time_s) = 0;
  /// Every CAN bus of the machine, before its drives are set up; std::runtime_error where one cannot be used.
  virtual std::vector<ScannedBus> scan() = 0;
  /// Nothing moves: the drives are emulated.
  virtual bool rehearses() const = 0;
  /// Where the time of `latest_us` comes from.
  virtual const char* clock() const = 0;
  /// Every period's report from now on, in the thread that waits; null: nobody.
  void watch(std::function<void(const CycleReport&)> watcher) { watcher_ = std::move(watcher); }

  /// The spindle turns at so many rpm, + clockwise, as by M3, M4 or M5; false: the machine did not take it.
  bool turn_spindle(double rpm);

  void post(const RtCommand& command) { cycle_->post(command); }
  Assembly& assembly() { return assembly_; }
  /// Waits until `done`, at most so long; true when it came.
  bool until(const std::function<bool(const CycleReport&)>& done, double time_s);

 protected:
  explicit CommissionMachine(Assembly assembly) : assembly_(std::move(assembly)), queue_(64) {}

  std::function<void(const CycleReport&)> watcher_;
  Assembly assembly_;
  MotionQueue queue_;
  std::unique_ptr<Cycle> cycle_;
};

/// What is done by hand.
enum class HandStep { kNegativeSwitch, kPositiveSwitch, kProbe };

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
  /// Did the spindle turn clockwise, seen from above?
  virtual bool turned_clockwise(const std::string& text) = 0;
  /// Will do by hand what `text` says, and let go when it was heard; false: no. `joint`: whose switch.
  virtual bool does(const std::string& text, HandStep step, int joint) = 0;
  virtual void lets_go(const std::string& text) = 0;
  /// What is happening, and what came out.
  virtual void tell(const std::string& text) = 0;
};

}  // namespace trn

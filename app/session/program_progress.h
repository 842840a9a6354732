#pragma once

#include <cstdint>

#include "app/session/plan_time.h"
#include "app/session/program_step.h"
#include "app/session/program_time.h"
#include "kernel/rt_messages.h"

namespace trn {

/// How far a program has come and how long it still takes, by the times of its plan.
class ProgramProgress {
 public:
  explicit ProgramProgress(double period_s) : period_s_(period_s) {}

  /// Another program; nothing is known of it yet.
  void begin();
  void set_total(const ProgramTime& total) { total_ = total; }
  /// Every report of the tick. `step`: that of the report while the program is at work, else null. Where the
  /// machine rests, the program has not begun.
  void report(const CycleReport& report, const ProgramStep* step, const OverrideShares& shares);

  bool known() const { return total_.known; }
  /// As ProgramTime::about.
  bool about() const { return total_.about || other_lines_; }
  /// The program goes on with other lines than those whose time is known, until the machine rests.
  void lines_change() { other_lines_ = true; }
  /// Of the whole program at 100 %, s; 0: not known.
  double total_s() const { return total_.known ? total_.time.total_s() : 0; }
  /// Of it, up to where the machine is, s.
  double done_s() const { return done_.total_s(); }
  /// Until its end at the overrides of now, s; -1: not known, or one of them is 0.
  double left_s() const;

 private:
  /// What was driven since the feed override is as it is: time, and plan time that passed in it. Above 100 %
  /// the joints' limits say how much of what is asked for is driven; below, short moves end before the rate
  /// is there.
  struct Driven {
    double time_s = 0, plan_s = 0;
    double rate(double asked) const;
  };
  void learn(const CycleReport& report, PlanTime::Kind kind);
  /// Where rapid moves begin, the rate needs a while to fall to their override: this saves each run a time
  /// that hardly depends on its length.
  struct RapidRun {
    double time_s = 0, plan_s = 0;
    bool whole = false;  ///< the override has been the same since it began
  };
  void learn_rapid(const CycleReport& report, bool rapid);
  double saved_s(const PlanTime& left) const;

  double period_s_;
  ProgramTime total_;
  PlanTime done_;
  std::uint32_t step_ = 0;
  double in_step_s_ = 0;      ///< plan time of the present step that has passed
  bool other_lines_ = false;  ///< lines_change
  OverrideShares shares_;
  Driven feed_;
  RapidRun run_;
  bool in_run_ = false;
  double runs_saved_s_ = 0, runs_ = 0;  ///< of the runs that were driven at this override
};

}  // namespace trn

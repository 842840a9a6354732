#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "app/lab/commission/commission_machine.h"
#include "app/lab/tune/tune_data.h"
#include "core/axes.h"
#include "core/machine.h"
#include "kernel/rt_messages.h"

namespace trn {

/// One item of the check-list and what came of it.
struct CommissionItem {
  std::string name;    ///< "direction X"; the key in the record
  std::string result;  ///< "good", "changed", "rehearsed", "skipped", "failed"; "" while it has not been done
  std::string note;    ///< what was measured, what was changed
};

/// A machine's check-list, from the drives on the bus to the latency. It goes on where it was left:
/// the record is a JSON file. What an item finds wrong it mends in the config, and the machine is made anew.
class Commission {
 public:
  /// With or without its feed-forward.
  using MakeMachine = std::function<std::unique_ptr<CommissionMachine>(bool feed_forward)>;
  struct Files {
    std::string config, record;
  };

  /// `machine` is where the machine lives; it is made when the first item needs it.
  Commission(const Files& files, MakeMachine make, std::unique_ptr<CommissionMachine>& machine,
             CommissionOperator& person);

  /// Every item that is not done yet, in order; after an item that fails no other is begun. True when all are
  /// done.
  bool run();
  const std::vector<CommissionItem>& items() const { return items_; }
  /// The list as a document in Markdown.
  std::string protocol() const;

 private:
  struct Outcome {
    std::string result, note;
  };
  void list_items();
  void read_record();
  void write_record() const;
  Outcome perform(const std::string& name);
  CommissionMachine& machine();
  void leave_machine();
  void change(const std::string& header, int number, const std::string& key, const std::string& value);
  void change_text(const std::string& text);
  int node_of(int joint) const;

  Outcome ask_plausible();
  Outcome check_bus();
  Outcome identity();
  Outcome scale(int joint);
  Outcome direction(int word);
  Outcome limit_switches();
  Outcome home();
  Outcome ends(int joint);
  Outcome brake(int joint);
  Outcome following(int joint);
  Outcome tuning(int joint);
  Outcome spindle();
  std::string stroke(int joint, const TuneStroke& stroke);
  Outcome probe();
  Outcome latency();

  std::string move(const JointVec& way, double share);
  std::string ready();
  std::string at_home();
  std::string homed();
  std::string by_hand(const std::string& what, HandStep step, int joint,
                      const std::function<bool(const CycleReport&)>& heard);
  std::string turn(double rpm, double& encoder_turns);

  Files files_;
  MakeMachine make_;
  std::unique_ptr<CommissionMachine>& machine_;
  CommissionOperator& person_;
  Machine described_;  ///< as the config has it now
  std::vector<CommissionItem> items_;
  bool feeds_forward_ =
      true;  ///< until a joint is tuned: told in advance, the torque is not that of its loops alone
  double worst_lag_ = 0;  ///< of the joint that moved last
};

}  // namespace trn

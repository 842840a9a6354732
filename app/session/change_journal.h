#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"

namespace trn {

/// What the lines of a program have set, in the order in which they were read. A program is read ahead of its
/// motion: where it is given up, what lies behind the place where the machine stands can be taken back.
class ChangeJournal {
 public:
  /// Both must outlive it.
  ChangeJournal(Parameters& parameters, ToolTable& tools);

  /// A program begins: what was set before is not its own. One that was given up in a sub-program has left
  /// that.
  void begin();
  /// A line was read, and `block` blocks were run with it (ProgramStep::block); `steps`: so many moves and
  /// events the program has handed on by now.
  void line_done(std::uint64_t block, std::uint64_t steps);
  /// While the program waits for the machine or at a stop, so that all before has been driven: what was set
  /// since its last step, by the operator or by the machine's answer, stays.
  void adopt();
  /// As it was behind the step of that block. What was set up to the first step stays, for no motion comes
  /// before it: a typed G10 is in force, however soon a stop follows. So does what the lines have set that
  /// were passed over, where a program was begun further down.
  void take_back_to(std::uint64_t block);
  /// As it was at `begin`.
  void take_back();

  /// More steps than a program is read ahead; what is behind that many counts as driven.
  static constexpr std::size_t kStepsMax = 50000;

 private:
  /// A step, with what was set by its line and those before it, since the step before.
  struct Step {
    std::uint64_t block = 0;
    std::vector<ParameterChange> changes;
    std::unique_ptr<ToolTable> tools;  ///< as they were; null: they have not changed
  };
  void note(std::uint64_t block);
  std::unique_ptr<ToolTable> take_tools();
  void take_back(const Step& step);
  void take_back_behind(std::uint64_t block);

  Parameters& parameters_;
  ToolTable& tools_;
  ToolTable tools_before_;
  std::uint64_t steps_handed_ = 0;
  std::optional<std::uint64_t> first_;  ///< the first step's block
  std::deque<Step> steps_;
};

}  // namespace trn

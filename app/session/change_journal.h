#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
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
  /// As it was behind the step of that block; 0: as the program found it. For a program that was begun
  /// further down, that includes what the lines before have set.
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

  Parameters& parameters_;
  ToolTable& tools_;
  ToolTable tools_before_;
  std::uint64_t steps_handed_ = 0;
  std::deque<Step> steps_;
};

}  // namespace trn

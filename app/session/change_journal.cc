#include "app/session/change_journal.h"

#include <algorithm>
#include <utility>

namespace trn {

ChangeJournal::ChangeJournal(Parameters& parameters, ToolTable& tools)
    : parameters_(parameters), tools_(tools), tools_before_(tools) {}

void ChangeJournal::begin() {
  parameters_.leave_sub_programs();
  parameters_.take_changes();
  take_tools();
  steps_.clear();
  steps_handed_ = 0;
  first_.reset();
}

std::unique_ptr<ToolTable> ChangeJournal::take_tools() {
  if (tools_.revision() == tools_before_.revision()) return nullptr;
  return std::make_unique<ToolTable>(std::exchange(tools_before_, tools_));
}

// The lines between two steps, however many, are one with the second: the machine never stands between them.
void ChangeJournal::line_done(std::uint64_t block, std::uint64_t steps) {
  if (std::exchange(steps_handed_, steps) == steps) return;
  if (!first_) first_ = block;
  note(block);
}

void ChangeJournal::adopt() { note(0); }

void ChangeJournal::note(std::uint64_t block) {
  Step step{block, parameters_.take_changes(), take_tools()};
  if (step.changes.empty() && !step.tools) return;
  steps_.push_back(std::move(step));
  if (steps_.size() > kStepsMax) steps_.pop_front();
}

void ChangeJournal::take_back(const Step& step) {
  parameters_.take_back(step.changes);
  if (step.tools) tools_ = *step.tools;
}

void ChangeJournal::take_back_to(std::uint64_t block) {
  parameters_.leave_sub_programs();
  if (first_) take_back_behind(std::max(block, *first_));
}

void ChangeJournal::take_back() {
  parameters_.leave_sub_programs();
  take_back_behind(0);
  for (; !steps_.empty(); steps_.pop_back()) take_back(steps_.back());
  tools_before_ = tools_;
}

void ChangeJournal::take_back_behind(std::uint64_t block) {
  take_back(Step{0, parameters_.take_changes(), take_tools()});
  for (; !steps_.empty() && steps_.back().block > block; steps_.pop_back()) take_back(steps_.back());
  tools_before_ = tools_;
}

}  // namespace trn

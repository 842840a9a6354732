#include "app/session/machine_memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <string>

#include "interp/gcode/parameter_file.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"

namespace trn {

namespace {

bool names_removed(const std::string& line, const ToolTable& kept, const ToolTable& now) {
  try {
    const ToolTable of_line = ToolTable::parse(line, "");
    return std::any_of(of_line.tools().begin(), of_line.tools().end(),
                       [&](const auto& tool) { return kept.find(tool.first) && !now.find(tool.first); });
  } catch (const ProgramError&) {
    return false;
  }
}

// Without lines of tools that were taken out since. One that somebody else has added stays.
std::string without_removed(const std::string& text, const ToolTable& kept, const ToolTable& now) {
  std::string out;
  for (std::size_t begin = 0, end = 0; begin < text.size(); begin = end) {
    end = std::min(text.find('\n', begin), text.size() - 1) + 1;
    const std::string line = text.substr(begin, end - begin);
    if (!names_removed(line, kept, now)) out += line;
  }
  return out;
}

}  // namespace

// What the file of variables holds (parameters_text), but for the results of the last input.
const MachineMemory::Range MachineMemory::kMachine[] = {{parameter::kProbe, parameter::kProbeSuccess},
                                                        {parameter::kG28, parameter::kLastOffset},
                                                        {parameter::kTool, parameter::kTool}};
const MachineMemory::Range MachineMemory::kUser[] = {{parameter::kUserFirst, parameter::kUserLast}};

MachineMemory::MachineMemory(Parameters& parameters, ToolTable& tools, MemoryFiles files)
    : parameters_(parameters), tools_(tools), files_(std::move(files)), kept_tools_(tools) {
  const auto values = std::as_const(parameters_).values(0, parameter::kMachineLast);
  kept_.assign(values.begin(), values.end());
  parameters_.take_touched();
}

template <std::size_t n>
bool MachineMemory::differs(const Range (&ranges)[n]) const {
  return std::any_of(std::begin(ranges), std::end(ranges), [this](const Range& range) {
    const auto now = std::as_const(parameters_).values(range.first, range.last);
    return std::memcmp(now.data(), kept_.data() + range.first, now.size_bytes()) != 0;
  });
}

void MachineMemory::restore_parameters() {
  const auto restore = [this](const Range& range) {
    for (int n = range.first; n <= range.last; ++n) parameters_[n] = kept_[static_cast<std::size_t>(n)];
  };
  std::for_each(std::begin(kMachine), std::end(kMachine), restore);
  std::for_each(std::begin(kUser), std::end(kUser), restore);
  parameters_.take_touched();
  touched_ = false;
}

void MachineMemory::keep(bool all) {
  keep_tools();
  touched_ |= parameters_.take_touched();
  if (touched_) keep_parameters(all);
}

void MachineMemory::keep_parameters(bool all) {
  const bool machine = differs(kMachine);
  const Clock::time_point now = Clock::now();
  const bool due = all || std::chrono::duration<double>(now - kept_at_).count() > kSlack_s;
  if (!machine && !due) return;
  if (machine || differs(kUser)) {
    try {
      if (!files_.vars.empty()) write_file_safely(files_.vars, parameters_text(parameters_));
    } catch (const FileError&) {
      restore_parameters();
      throw;
    }
    const auto values = std::as_const(parameters_).values(0, parameter::kMachineLast);
    std::copy(values.begin(), values.end(), kept_.begin());
    kept_at_ = now;
  }
  touched_ = false;
}

// Lines of tools that are as they were stay as the file has them, with its comments and order.
void MachineMemory::keep_tools() {
  if (tools_.revision() == kept_tools_.revision()) return;
  try {
    if (!files_.tools.empty()) {
      const bool there = std::filesystem::exists(files_.tools);
      write_file_safely(
          files_.tools,
          tools_.text_over(there ? without_removed(read_text_file(files_.tools), kept_tools_, tools_) : ""));
    }
  } catch (const std::exception& error) {
    tools_ = kept_tools_;
    throw FileError(error.what());
  }
  const std::lock_guard lock(mutex_);
  kept_tools_ = tools_;
}

std::string MachineMemory::tool_name(int number) const {
  const std::lock_guard lock(mutex_);
  return trn::tool_name(kept_tools_, number);
}

std::map<int, std::string> MachineMemory::tool_names() const {
  const std::lock_guard lock(mutex_);
  std::map<int, std::string> names;
  for (const auto& [number, tool] : kept_tools_.tools()) names[number] = trn::tool_name(kept_tools_, number);
  return names;
}

}  // namespace trn

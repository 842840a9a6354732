#pragma once

#include <string>
#include <vector>

namespace trn {

/// The files of a run.
struct RunInputs {
  std::string program, machine, tools;
  std::vector<std::string> remarks = {};  ///< "FILE:LINE:COLUMN: ..." of what the first lines name in vain
};

/// Fills in what the command line has left open. `project` is the project's folder, or "": a relative path
/// that is not found from here is looked for in it, a program also in its examples/ and without its ending;
/// without a program its impeller runs, without a machine its cradle.
///
/// Machine and tools may also stand in a comment of the program's first lines, relative to its folder:
/// "(machine: ../configs/mill.toml; tools: tools.tbl)", or "(machine: mill)". They count where the command
/// line names none.
RunInputs complete_inputs(RunInputs given, const std::string& project);

/// Tells the remarks. ProgramError or CLI::RequiredError if the program is no file, or no machine is named.
void check_inputs(const RunInputs& inputs);

}  // namespace trn

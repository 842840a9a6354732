#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>

namespace trn {

/// Gives every command of trunnion the headline under which the help lists it.
void sort_into_groups(CLI::App& app);

/// Where the help lists a command; the same for all that stand in no group.
std::size_t command_rank(const CLI::App& command);

}  // namespace trn

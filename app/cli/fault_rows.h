#pragma once

#include <functional>
#include <nlohmann/json.hpp>

#include "app/cli/commands.h"
#include "app/lab/fault_rehearsal.h"

namespace trn {

nlohmann::ordered_json json_of(const RehearsedFault& row);
void print_fault_header();
void print_fault_row(const RehearsedFault& row);

/// What the columns mean.
inline constexpr const char* kFaultColumns =
    "fault: periods from cause to latched fault; rest: until no drive moves; creeps: way in the\n"
    "second after that (mm, rad); place: position kept; recover: periods from 'reset' to enabled.\n"
    "Exit codes: 0 every row is as it should be, 3 bad config, 4 a row is not, 5 usage.";

}  // namespace trn

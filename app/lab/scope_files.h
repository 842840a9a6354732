#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/session/scope_record.h"

namespace trn {

/// A picture of the record: a panel for each unit, the trigger at 0 s.
std::string scope_svg(const ScopeRecord& record);

/// The record as a log of LCM: scope_data_t messages of a hundred rows each, on the machine's channel.
/// `first_unix_us`: when its first period was.
std::vector<std::uint8_t> scope_lcm_log(const ScopeRecord& record, std::int64_t first_unix_us);

}  // namespace trn

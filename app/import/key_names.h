#pragma once

#include <string>
#include <string_view>

namespace trn {

/// The name "[SECTION]KEY" in capital letters that LinuxCNC looks for, if this one differs from it by small
/// letters alone; else "".
std::string key_in_capitals(std::string_view section, std::string_view key);

}  // namespace trn

#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace trn {

/// What somebody may do. Each role may do what those before it may.
enum class Role : std::uint8_t {
  kLook,     ///< see state and motion; stop the machine
  kOperate,  ///< move it: programs, MDI, jog, home, overrides, reset, sensor readings
  kSetUp,    ///< change how it moves: switch corrections
  kCount
};
std::string_view to_string(Role role);
/// The reverse; nothing if no role is called so.
std::optional<Role> role_called(std::string_view name);

}  // namespace trn

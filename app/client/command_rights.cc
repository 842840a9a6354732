#include "app/client/command_rights.h"

#include <array>
#include <cstddef>

namespace trn {

namespace {

constexpr std::array<std::string_view, static_cast<std::size_t>(Role::kCount)> kRoles{"look", "operate",
                                                                                      "set up"};
static_assert(!kRoles.back().empty());  // a row for each

}  // namespace

std::string_view to_string(Role role) { return kRoles[static_cast<std::size_t>(role)]; }

std::optional<Role> role_called(std::string_view name) {
  for (std::size_t i = 0; i < kRoles.size(); ++i)
    if (kRoles[i] == name) return static_cast<Role>(i);
  return std::nullopt;
}

}  // namespace trn

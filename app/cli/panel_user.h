#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace trn {

/// panel user add, list, remove
void add_panel_user(CLI::App& panel);

/// The file of users of this account's panels: "users" in $STATE_DIRECTORY, or below $HOME.
std::string own_users_file();

}  // namespace trn

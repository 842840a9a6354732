#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace trn {

/// The manual's page of a program or one of its commands, as roff, from what its help says.
std::string man_page(const CLI::App& app);

}  // namespace trn

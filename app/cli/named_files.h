#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace trn {

/// What `--machine` is, for its help.
inline constexpr const char* kMachineOption = "The machine by its name, as mill, or its config (.toml)";
/// And what it is to a client of a daemon.
inline constexpr const char* kMachineHelp =
    "The machine whose daemon is asked, by its name, or its config (.toml); default: the one that runs here";

/// A regular file is there, or a link to one; never an error.
bool is_file(const std::filesystem::path& path);

/// An example by its name alone, "impeller", as the file that it is, in the source or where this program is
/// installed; any other text as it is.
std::string with_examples(const std::string& program);

/// A machine by its name alone, "mill", as its config. The first of these that is a file: mill.toml,
/// mill/mill.toml (which `import` writes) and configs/mill.toml in `folder`, "" being the current one;
/// /etc/trunnion/mill.toml; the config of that name that comes with Trunnion. Nothing if there is none, or
/// `name` is no name: it has a '/' or a '.' in it.
std::optional<std::string> machine_of_name(const std::string& name, const std::filesystem::path& folder = {});

/// Names for `machine_of_name`: of what is in configs/, in /etc/trunnion and comes with Trunnion; sorted.
std::vector<std::string> machine_names();

/// Lets every `--machine` of `app` and its commands take a machine's name in the place of its config. The
/// clients' is left out, where the name is one of a daemon that runs, and that of `commission`, which writes
/// the config.
void take_machine_names(CLI::App& app);

}  // namespace trn

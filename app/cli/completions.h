#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace trn {

/// What may stand for the last of `words`, which come behind the program's name; the last may be empty or
/// half a word. A line each, "WORD\tMEANING"; ":files" or ":files toml" asks the shell for names of files.
std::string complete_word(const CLI::App& app, const std::vector<std::string>& words);

/// The script with which a shell asks `trunnion complete` for what may come next; "" for a shell that is not
/// known.
std::string completion_script(const std::string& shell);

}  // namespace trn

#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

namespace trn {

/// A command, also one of a command's own ("can sdo"); nothing if a word is none. No words: the program
/// itself.
const CLI::App* find_command(const CLI::App& app, const std::vector<std::string>& words);

/// What to say of the first word of a command line that is no command, or no option of its command, with the
/// nearest that there is; nothing if all are known.
std::optional<std::string> unknown_word(const CLI::App& app, const std::vector<std::string>& words);

/// The command that a command line has come to: "can sdo" of `trunnion can sdo --eds x`.
const CLI::App& command_of(const CLI::App& app, const std::vector<std::string>& words);

/// What is wrong with a command line, in words for people, and where its help is.
std::string usage_text(const CLI::App& app, const CLI::ParseError& error,
                       const std::vector<std::string>& words);

}  // namespace trn

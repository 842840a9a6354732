#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace trn {

/// Gives every command of trunnion the headline under which the help lists it.
void sort_into_groups(CLI::App& app);
/// The commands that a help lists, in its order: those with a name and a group.
std::vector<const CLI::App*> shown_commands(const CLI::App& app);
/// The options, or the arguments, that a help lists.
std::vector<const CLI::Option*> shown_options(const CLI::App& app, bool positional);
/// `text` in lines that fit on the terminal, from this column on. Its own line ends stay.
std::string wrapped(std::string_view text, std::size_t column);
/// What a command does, as sentences that end.
std::string full_text(const CLI::App& command);
/// What a command does, in one line: "Judge a setpoint trace against the machine's limits".
std::string first_sentence(const CLI::App& command);

/// What an option is for: "Write the setpoints of every period (CSV)".
std::string option_text(const CLI::Option& option);

/// The words of "TEXT:{on,off}"; none where any value is legal.
std::vector<std::string> choices_of(const CLI::Option& option);
/// False of a flag.
bool takes_value(const CLI::Option& option);
/// "FILE", "NUMBER", "on|off"; "" of a flag.
std::string value_name(const CLI::Option& option);
/// What is legal and what counts without it: " (1 to 100; default 5)"; "" where there is nothing to say.
std::string option_remarks(const CLI::Option& option);

/// Help as CLI11 has it, with lines that fit on a terminal and one sentence for a command in a list.
class HelpFormatter final : public CLI::Formatter {
 public:
  HelpFormatter();
  std::string make_subcommands(const CLI::App* app, CLI::AppFormatMode mode) const override;
  std::string make_subcommand(const CLI::App* sub) const override;
  std::string make_option(const CLI::Option* opt, bool is_positional) const override;
  std::string make_description(const CLI::App* app) const override;
};

}  // namespace trn

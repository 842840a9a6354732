#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>

#include "app/cli/commands.h"
#include "app/cli/completions.h"
#include "app/cli/help_formatter.h"
#include "app/cli/man_page.h"
#include "app/cli/unknown_word.h"

namespace trn {

namespace {

void write_page(const std::filesystem::path& folder, const std::string& name, const CLI::App& app) {
  const std::filesystem::path path = folder / (name + ".1");
  std::ofstream out(path);
  out << man_page(app);
  if (!out.flush()) throw std::runtime_error(fmt::format("{}: cannot write", path.string()));
}

void write_pages(const std::string& folder, const CLI::App& app) {
  std::filesystem::create_directories(folder);
  write_page(folder, "trunnion", app);
  for (const CLI::App* command : shown_commands(app))
    write_page(folder, "trunnion-" + command->get_name(), *command);
}

void show_page(const std::string& name, const CLI::App& app) {
  const CLI::App* command = name.empty() ? &app : find_command(app, {name});
  if (!command) throw CLI::ValidationError("command", fmt::format("'{}' is no command", name));
  fmt::print("{}", man_page(*command));
}

void add_man(CLI::App& app) {
  CLI::App* man = app.add_subcommand("man", "Print the manual's page of a command, as roff");
  auto name = std::make_shared<std::string>(), folder = std::make_shared<std::string>();
  man->add_option("command", *name, "a command; without one the page of the program");
  man->add_option("--all", *folder,
                  "write the pages of all commands into this folder, as the packages have them");
  man->footer("Example: trunnion man run | man -l -");
  man->callback([&app, name, folder] {
    if (folder->empty())
      show_page(*name, app);
    else
      write_pages(*folder, app);
  });
}

}  // namespace

void add_manual(CLI::App& app) {
  add_man(app);
  CLI::App* completions = app.add_subcommand(
      "completions", "Print the script with which a shell completes commands, options and files");
  auto shell = std::make_shared<std::string>();
  completions->add_option("shell", *shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  completions->footer(
      "The packages install these scripts. From a build, for one session of bash:\n"
      "  eval \"$(trunnion completions bash)\"");
  completions->callback([shell] { fmt::print("{}", completion_script(*shell)); });
}

}  // namespace trn

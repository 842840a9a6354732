#include "app/cli/unknown_word.h"

#include <fmt/format.h>

#include "app/cli/help_formatter.h"
#include "core/config.h"

namespace trn {

namespace {

std::string name_of(const CLI::App& app) {
  return app.get_parent() ? name_of(*app.get_parent()) + " " + app.get_name() : app.get_name();
}

std::string near_text(const std::string& word, const std::vector<std::string>& legal) {
  const std::string near = nearest_word(word, legal);
  return near.empty() ? "" : fmt::format("; did you mean '{}'?", near);
}

std::string no_command(const CLI::App& app, const std::string& word) {
  std::vector<std::string> legal;
  for (const CLI::App* command : shown_commands(app)) legal.push_back(command->get_name());
  if (!app.get_parent()) {
    legal.push_back("help");
    return fmt::format("'{}' is no command{}; 'trunnion help' lists them all\n", word,
                       near_text(word, legal));
  }
  return fmt::format("'{}' is no command of '{}'{}; 'trunnion help {}' lists them\n", word, name_of(app),
                     near_text(word, legal), app.get_name());
}

std::string no_option(const CLI::App& app, const std::string& word) {
  std::vector<std::string> legal;
  for (const CLI::Option* option : shown_options(app, false))
    for (const std::string& name : option->get_lnames()) legal.push_back("--" + name);
  return fmt::format("'{}' has no option '{}'{}; '{} --help' lists them\n", name_of(app), word,
                     near_text(word, legal), name_of(app));
}

bool is_number(const std::string& word) { return word.find_first_of("0123456789.") == 1; }

}  // namespace

const CLI::App* find_command(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* found = &app;
  for (const std::string& word : words) {
    const CLI::App* inner = nullptr;
    for (const CLI::App* command : shown_commands(*found))
      if (command->get_name() == word) inner = command;
    if (!inner) return nullptr;
    found = inner;
  }
  return found;
}

std::optional<std::string> unknown_word(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* here = &app;
  bool is_value = false;
  for (const std::string& word : words) {
    if (is_value) {
      is_value = false;
    } else if (word.size() > 1 && word[0] == '-') {
      const std::string name = word.substr(0, word.find('='));
      const CLI::Option* option = here->get_option_no_throw(name);
      if (!option && !is_number(word)) return no_option(*here, name);
      is_value = option && takes_value(*option) && name == word;
    } else if (const CLI::App* inner = find_command(*here, {word})) {
      here = inner;
    } else if (!shown_commands(*here).empty()) {
      return no_command(*here, word);
    }
  }
  return std::nullopt;
}

}  // namespace trn

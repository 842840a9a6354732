#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/cli/commands.h"
#include "app/cli/completions.h"
#include "app/cli/habits.h"
#include "app/cli/help_formatter.h"
#include "app/cli/meant_command.h"
#include "app/cli/micromill.h"
#include "app/cli/named_files.h"
#include "app/cli/topics.h"
#include "app/cli/unknown_word.h"
#include "app/cli/version.h"

namespace {

constexpr const char kDescription[] =
    "Trunnion: a CNC control. It reads G-code and moves a machine, or simulates one.\n"
    "Run a program in simulation:   trunnion run impeller\n"
    "Drive a machine:               trunnion daemon --machine mill";

constexpr const char kLesson[] =
    "Trunnion reads G-code, plans the motion and drives the joints of a machine. Try it without a machine:\n"
    "\n"
    "  trunnion run impeller                     cut a five-axis part in simulation\n"
    "  trunnion run impeller --report pictures   and draw speed, joints and deviation\n"
    "  trunnion run part.ngc --machine my.toml   your program on your machine\n"
    "\n"
    "Then start a machine (the drives of this config are simulated), and move it from a second terminal:\n"
    "\n"
    "  trunnion daemon --machine mill\n"
    "  trunnion home --wait\n"
    "  trunnion mdi 'G0 X10' --wait\n"
    "  trunnion monitor\n"
    "\n"
    "'trunnion help' lists all commands, 'trunnion help COMMAND' explains one.\n";

constexpr const char kExits[] = "Exit codes: 0 done, 2 bad program, 3 bad config, 4 machine fault, 5 usage.";

void add_commands(CLI::App& app, trn::Exit& exit) {
  trn::add_run(app, exit);
  trn::add_interpret(app, exit);
  trn::add_check_trace(app, exit);
  trn::add_replay(app, exit);
  trn::add_daemon(app, exit);
  trn::add_panel(app, exit);
  trn::add_mqtt(app, exit);
  trn::add_clients(app, exit);
  trn::add_tables(app, exit);
  trn::add_sensor(app, exit);
  trn::add_scope(app, exit);
  trn::add_tune(app, exit);
  trn::add_config(app, exit);
  trn::add_import(app, exit);
  trn::add_kin(app, exit);
  trn::add_workspace(app, exit);
  trn::add_following(app, exit);
  trn::add_io(app, exit);
  trn::add_commission(app, exit);
  trn::add_latency(app, exit);
  trn::add_can(app, exit);
  trn::add_modbus(app, exit);
  trn::add_ballbar(app, exit);
  trn::add_ball(app, exit);
  trn::add_joint_table(app, exit);
  trn::add_micromill(app, exit);
  trn::add_gateway(app, exit);
  trn::add_key(app);
  trn::add_manual(app);
}

// A code, a fault, a key or a word. One that others call a command gets the command that is meant, too.
bool tell_topic(const std::vector<std::string>& names) {
  const std::string name = fmt::format("{}", fmt::join(names, " "));
  const std::string text = trn::topic_text(name);
  fmt::print("{}", text);
  const std::string meant = names.size() == 1 && !trn::is_gcode(name) ? trn::meant_command(names) : "";
  if (!text.empty() && !meant.empty()) fmt::print("\n{}\n", trn::wrapped(meant, 0));
  return !text.empty();
}

trn::Exit help(const CLI::App& app, const std::vector<std::string>& names) {
  const CLI::App* command = trn::find_command(app, names);
  if (!command && tell_topic(names)) return trn::Exit::kDone;
  if (!command && !trn::unknown_word(app, names))
    command = &trn::command_of(app, names);  // "help run part.ngc"
  if (command) {
    std::string around;
    for (const CLI::App* up = command->get_parent(); up; up = up->get_parent())
      around = around.empty() ? up->get_name() : up->get_name() + " " + around;
    fmt::print("{}", command->help(around));
    return trn::Exit::kDone;
  }
  fmt::print(stderr, "{}", trn::unknown_word(app, names).value_or("'trunnion help' lists all commands\n"));
  return trn::Exit::kUsage;
}

// Nothing, `help [COMMAND]`, and a shell that asks what may come next. The rest is CLI11's to read.
std::optional<trn::Exit> answer(const CLI::App& app, const std::vector<std::string>& words) {
  if (words.empty()) {
    fmt::print("{}", kLesson);
    return trn::Exit::kUsage;
  }
  const std::vector<std::string> rest(words.begin() + 1, words.end());
  if (words[0] == "help")
    return help(app, rest == std::vector<std::string>{"help"} ? std::vector<std::string>() : rest);
  if (words[0] != "complete") return std::nullopt;
  fmt::print("{}", trn::complete_word(app, rest));
  return trn::Exit::kDone;
}

bool is_or_holds(const CLI::App& command, const CLI::App* chosen) {
  while (chosen && chosen != &command) chosen = chosen->get_parent();
  return chosen != nullptr;
}

// CLI11 gives an environment variable to the options of all commands. One that a command cannot take, as the
// name of a daemon's machine where a config is wanted, would end every other command, too.
void forget_other_variables(CLI::App& app, const CLI::App& chosen) {
  for (CLI::App* command : app.get_subcommands({})) {
    if (!is_or_holds(*command, &chosen))
      for (CLI::Option* option : command->get_options({})) option->envname("");
    forget_other_variables(*command, chosen);
  }
}

int tell_usage(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& words) {
  if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
  // CLI11 meets the value of an environment variable before --help, and a wrong one must not hide the help.
  const auto asks = [](const std::string& word) { return word == "--help" || word == "-h"; };
  if (std::any_of(words.begin(), words.end(), asks)) return app.exit(CLI::CallForHelp());
  fmt::print(stderr, "{}", trn::usage_text(app, error, words));
  return static_cast<int>(trn::Exit::kUsage);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{kDescription, "trunnion"};
  app.formatter(std::make_shared<trn::HelpFormatter>());
  app.footer(kExits);
  app.set_version_flag("--version", trn::version_text("trunnion"), "Print version and commit");
  app.require_subcommand(1);
  trn::Exit exit = trn::Exit::kDone;
  add_commands(app, exit);
  trn::take_machine_names(app);
  trn::sort_into_groups(app);
  app.footer(
      std::string(kExits) +
      "\n'trunnion help COMMAND' explains a command. So it does a code of a program (trunnion help G83),\n"
      "a fault (help following_error), a key of a config (help jerk_mm_s3) and a word (help RTCP).");
  const std::vector<std::string> words = trn::as_commands_read({argv + 1, argv + argc});
  if (const auto answered = answer(app, words)) return static_cast<int>(*answered);
  forget_other_variables(app, trn::command_of(app, words));
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  } catch (const CLI::ParseError& error) {
    return tell_usage(app, error, words);
  } catch (const std::exception&) {
    exit = trn::tell_exception(trn::Exit::kMachineFault);
  }
  return static_cast<int>(exit);
}

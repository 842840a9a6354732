#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#include "app/cli/commands.h"
#include "app/cli/micromill.h"
#include "core/config.h"

namespace {

const CLI::App* find_command(const CLI::App& app, const std::string& name) {
  for (const CLI::App* command : app.get_subcommands({}))
    if (command->get_name() == name) return command;
  return nullptr;
}

// `trunnion help [COMMAND]`, or a word that is no command. Nothing if the line is CLI11's to read.
std::optional<trn::Exit> explain(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-' || find_command(app, argv[1])) return std::nullopt;
  const std::string word = argv[1];
  if (word == "help") {
    const CLI::App* command = argc > 2 ? find_command(app, argv[2]) : &app;
    fmt::print("{}", (command ? command : &app)->help());
    return trn::Exit::kDone;
  }
  std::vector<std::string> legal = {"help"};
  for (const CLI::App* command : app.get_subcommands({})) legal.push_back(command->get_name());
  const std::string near = trn::nearest_word(word, legal);
  fmt::print(stderr, "'{}' is no command{}; 'trunnion help' lists them all\n", word,
             near.empty() ? "" : fmt::format("; did you mean '{}'?", near));
  return trn::Exit::kUsage;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Trunnion: a real-time CNC interpolator and kinematics kernel.\n"
      "Run a program in simulation:   trunnion run part.ngc --machine configs/cradle.toml\n"
      "Drive a machine:               trunnion daemon --machine configs/cradle.toml",
      "trunnion"};
  app.footer(
      "Exit codes: 0 done, 2 bad program, 3 bad config, 4 machine fault, 5 usage.\n"
      "'trunnion help COMMAND' explains a command.");
  app.set_version_flag("--version", TRN_VERSION);
  app.require_subcommand(1);
  trn::Exit exit = trn::Exit::kDone;
  trn::add_run(app, exit);
  trn::add_interpret(app, exit);
  trn::add_kin(app, exit);
  trn::add_workspace(app, exit);
  trn::add_check_trace(app, exit);
  trn::add_config(app, exit);
  trn::add_import(app, exit);
  trn::add_micromill(app, exit);
  trn::add_daemon(app, exit);
  trn::add_ballbar(app, exit);
  trn::add_ball(app, exit);
  trn::add_joint_table(app, exit);
  trn::add_clients(app, exit);
  trn::add_tables(app, exit);
  trn::add_latency(app, exit);
  trn::add_sensor(app, exit);
  trn::add_gateway(app, exit);
  trn::add_panel(app, exit);
  trn::add_key(app);
  trn::add_can(app, exit);
  trn::add_modbus(app, exit);
  trn::add_replay(app, exit);
  if (const auto explained = explain(app, argc, argv)) return static_cast<int>(*explained);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(trn::Exit::kUsage);
  } catch (const std::exception&) {
    exit = trn::tell_exception(trn::Exit::kMachineFault);
  }
  return static_cast<int>(exit);
}

#include <fmt/format.h>

#include <cstdio>
#include <exception>

#include "kernel/commands/commands.h"
#include "kernel/commands/micromill.h"

int main(int argc, char** argv) {
  CLI::App app{
      "Trunnion: a real-time CNC interpolator and kinematics kernel.\n"
      "Run a program in simulation:   trunnion run part.ngc --machine configs/cradle.toml\n"
      "Drive a machine:               trunnion daemon --machine configs/cradle.toml",
      "trunnion"};
  app.footer(
      "Exit codes: 0 done, 2 bad program, 3 bad config, 4 machine fault, 5 usage.\n"
      "'trunnion COMMAND --help' explains a command.");
  app.set_version_flag("--version", TRN_VERSION);
  app.require_subcommand(1);
  trn::Exit exit = trn::Exit::kDone;
  trn::add_run(app, exit);
  trn::add_interpret(app, exit);
  trn::add_kin(app, exit);
  trn::add_workspace(app, exit);
  trn::add_check_trace(app, exit);
  trn::add_micromill(app, exit);
  trn::add_daemon(app, exit);
  trn::add_ballbar(app, exit);
  trn::add_joint_table(app, exit);
  trn::add_clients(app, exit);
  trn::add_sensor(app, exit);
  trn::add_can(app, exit);
  trn::add_modbus(app, exit);
  trn::add_replay(app, exit);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(trn::Exit::kUsage);
  } catch (const std::exception&) {
    exit = trn::tell_exception(trn::Exit::kMachineFault);
  }
  return static_cast<int>(exit);
}

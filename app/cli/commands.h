#pragma once

#include <CLI/CLI.hpp>
#include <exception>

namespace trn {

/// What the process returns; documented in `trunnion --help`.
enum class Exit : int { kDone = 0, kBadProgram = 2, kBadConfig = 3, kMachineFault = 4, kUsage = 5 };

/// In a handler: prints what was thrown and gives the exit code of its kind, `otherwise` if it is of none.
/// Errors of the command line go on to whoever parsed it.
Exit tell_exception(Exit otherwise);

/// Runs the work of a command that reads measurements: what it throws without a kind of its own is about
/// these.
template <typename Options>
Exit judging_measurements(Exit (*work)(const Options&), const Options& options) {
  try {
    return work(options);
  } catch (const std::exception&) {
    return tell_exception(Exit::kBadProgram);
  }
}

/// Each adds one sub-command; its callback sets `exit` (kDone unless something failed).
void add_run(CLI::App& app, Exit& exit);
void add_interpret(CLI::App& app, Exit& exit);
void add_kin(CLI::App& app, Exit& exit);
void add_workspace(CLI::App& app, Exit& exit);
void add_following(CLI::App& app, Exit& exit);
void add_check_trace(CLI::App& app, Exit& exit);
void add_config(CLI::App& app, Exit& exit);
/// import linuxcnc
void add_import(CLI::App& app, Exit& exit);
void add_daemon(CLI::App& app, Exit& exit);
void add_ballbar(CLI::App& app, Exit& exit);
/// ball fit, plan
void add_ball(CLI::App& app, Exit& exit);
void add_joint_table(CLI::App& app, Exit& exit);
/// can scan, sdo, nmt, monitor, lss, store, faults
void add_can(CLI::App& app, Exit& exit);
void add_can_settings(CLI::App& can, Exit& exit);
void add_can_faults(CLI::App& can, Exit& exit);
/// modbus scan, read, write, faults
void add_modbus(CLI::App& app, Exit& exit);
void add_modbus_faults(CLI::App& modbus, Exit& exit);
void add_replay(CLI::App& app, Exit& exit);
void add_latency(CLI::App& app, Exit& exit);
void add_sensor(CLI::App& app, Exit& exit);
void add_scope(CLI::App& app, Exit& exit);
void add_tune(CLI::App& app, Exit& exit);
void add_gateway(CLI::App& app, Exit& exit);
void add_panel(CLI::App& app, Exit& exit);
void add_mqtt(CLI::App& app, Exit& exit);
void add_io(CLI::App& app, Exit& exit);
void add_commission(CLI::App& app, Exit& exit);
/// key make, show
void add_key(CLI::App& app);
/// load, start, hold, resume, stop, mdi, jog, home, override, step, correction, status, monitor, estop, reset
void add_clients(CLI::App& app, Exit& exit);
/// man, completions
void add_manual(CLI::App& app);
/// offset, touch-off, tool: clients, too.
void add_tables(CLI::App& app, Exit& exit);

}  // namespace trn

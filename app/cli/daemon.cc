#include "app/daemon/daemon.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "app/cli/commands.h"
#include "app/cli/named_files.h"
#include "app/daemon/door.h"
#include "app/daemon/place_keeper.h"
#include "app/daemon/privileges.h"
#include "app/daemon/process_lock.h"
#include "app/daemon/program_process.h"
#include "app/daemon/rate_planner_thread.h"
#include "app/session/assembly.h"
#include "app/session/feature_recorder.h"
#include "app/session/make_cycle.h"
#include "app/session/pipeline.h"
#include "app/session/session_log.h"
#include "app/session/trace.h"
#include "core/config.h"
#include "core/plain_file.h"
#include "core/safe_file.h"
#include "interp/gcode/parameter_file.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"

namespace trn {

namespace {

struct DaemonOptions {
  std::string machine, tools, vars, record, log, logs, place;
};

constexpr std::size_t kQueueBlocks = 8192;

// What cannot be kept is told now; the command that wants to change it is refused.
void check_memory(const DaemonOptions& options) {
  if (options.vars.empty())
    spdlog::warn("no --vars: offsets and the tool in the spindle are lost when this ends");
  if (options.tools.empty()) spdlog::warn("no --tools: tool lengths are lost when this ends");
  for (const std::string& file : {options.vars, options.tools}) {
    if (file.empty()) continue;
    try {
      check_file_writable(file);
    } catch (const FileError& error) {
      spdlog::warn("{}; whatever would change it is refused", error.what());
    }
  }
  if (!options.logs.empty() && !std::filesystem::is_directory(options.logs))
    spdlog::warn("{} is no folder; a program that writes a log ends there", options.logs);
}

// The process that plans programs reads them; what is wrong with them is told before the machine starts.
void check_files(const DaemonOptions& options) {
  Parameters parameters;
  if (!options.vars.empty() && std::filesystem::exists(options.vars))
    load_parameters(options.vars, parameters);
  if (!options.tools.empty()) ToolTable::load(options.tools);
}

// The screws of a simulated machine warm up as it moves; real ones do so by themselves.
std::function<void(const CycleReport&)> warm_screws(const Assembly& assembly) {
  if (!assembly.screws) return {};
  return [screws = assembly.screws.get()](const CycleReport& report) {
    screws->step(report.q_plan, report.q_setpoint);
  };
}

// The file of this session's log; "": none is kept.
std::string make_session_file(const DaemonOptions& options) {
  if (options.log.empty()) return "";
  const std::string path = make_log_file(options.log);
  if (path != options.log) fmt::print(stderr, "{} has a session; this one goes to {}\n", options.log, path);
  return path;
}

// Beside the variables, if nothing else is asked for; "": nowhere.
std::string place_file(const DaemonOptions& options) {
  if (!options.place.empty() || options.vars.empty()) return options.place;
  return std::filesystem::path(options.vars).replace_extension(".place");
}

// Where the daemon writes: what it keeps, and the folder of its socket.
std::vector<std::string> write_folders(const DaemonOptions& options, const Door& door) {
  std::vector<std::string> folders{std::filesystem::path(door.clients().path()).parent_path()};
  for (const std::string& file :
       {options.vars, options.tools, options.record, options.log, place_file(options)})
    if (!file.empty()) folders.push_back(std::filesystem::absolute(file).parent_path());
  return folders;
}

void run_machine(const DaemonOptions& options) {
  log_to_stderr();
  const ConfigTable config = load_config(options.machine);
  check_files(options);
  ProgramProcess programs(config, {options.vars, options.tools, options.logs},
                          kQueueBlocks);  // before threads and sockets
  Assembly assembly = assemble(config, Field::kReal);
  Door door(assembly.machine.name, assembly.access);
  const TableLock vars_lock(options.vars, assembly.machine.name);
  const TableLock tools_lock(options.tools, assembly.machine.name);
  for (const TableLock* lock : {&vars_lock, &tools_lock})
    if (!lock->missing().empty()) spdlog::info("{}", lock->missing());
  Rights rights;
  rights.write_folders = write_folders(options, door);
  for (const std::string& bad : give_up_privileges(rights)) spdlog::warn("{}", bad);
  auto rate_plans = std::make_unique<RatePlannerThread>(assembly.plan_joints, assembly.machine.period_s);
  RatePlannerThread& rate_planner = *rate_plans;
  assembly.rate_plans = std::move(rate_plans);
  check_memory(options);
  Cycle cycle = make_cycle(assembly, programs.queue(), ProgramStops::kWait);
  std::unique_ptr<SessionLog> log;
  const std::string log_file = make_session_file(options);
  if (!log_file.empty())
    log = std::make_unique<SessionLog>(log_file,
                                       session_head(options.machine, options.tools, options.vars, false));
  FeatureRecorder recorder;
  FeatureRecorder* const features = assembly.corrections.setpoint->deflection() ? &recorder : nullptr;
  programs.tell(log.get(), features, ProgramSwitches::of(assembly));
  std::unique_ptr<TraceWriter> record;
  if (is_pipe(options.record))
    throw std::runtime_error(
        fmt::format("{}: --record cannot write into a pipe, whose reader would keep the daemon waiting; name "
                    "a file on a disk",
                    options.record));
  if (!options.record.empty())
    record = std::make_unique<TraceWriter>(options.record, assembly.machine, *assembly.map,
                                           *assembly.corrections.setpoint, false, true);
  std::optional<PlaceKeeper> place;
  if (const std::string file = place_file(options); !file.empty()) place.emplace(file);
  if (assembly.io) assembly.io->bring_up();
  run_daemon({assembly.machine,
              assembly.lcm,
              door,
              assembly.realtime,
              *assembly.drives,
              cycle,
              programs,
              rate_planner,
              record.get(),
              log.get(),
              assembly.map.get(),
              assembly.corrections.setpoint.get(),
              assembly.corrections.sensors.get(),
              assembly.corrections.background,
              warm_screws(assembly),
              assembly.io.get(),
              features,
              assembly.kinematics.get(),
              &assembly.plan_joints,
              TRN_VERSION,
              options.vars.empty() ? "" : options.vars + ".counters",
              place ? &*place : nullptr,
              assembly.scope,
              log_file});
  if (assembly.io) assembly.io->shut_down();
  programs.settle();
  if (record) record->close();
}

}  // namespace

void add_daemon(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<DaemonOptions>();
  CLI::App* daemon = app.add_subcommand("daemon", "Run the machine in real time and obey the clients");
  daemon->add_option("--machine,-m", options->machine, kMachineOption)->required();
  daemon
      ->add_option("--tools", options->tools,
                   "Tool table (LinuxCNC's .tbl), which G10 L1, L10 and L11 change")
      ->check(CLI::ExistingFile);
  daemon->add_option("--vars", options->vars,
                     "File of the variables (.var): offsets, the tool in the spindle, #31 to #5000. A change "
                     "is on disk before its command is answered. Parts and run time are kept beside it, in "
                     "FILE.counters");
  daemon->add_option("--place", options->place,
                     "Record here where the program is, for 'trunnion start --resume'; default: beside the "
                     "file of --vars, as NAME.place");
  daemon->add_option("--record", options->record, "Write the setpoints of every period to this trace (CSV)");
  daemon->add_option("--log", options->log,
                     "Write what operator and drives did to this file, for 'trunnion replay'. A file that "
                     "has a session stays, and FILE.1, FILE.2 ... is written");
  daemon->add_option("--logs", options->logs,
                     "Folder for the files that programs write with (LOGOPEN,NAME) and (LOG,TEXT). Without "
                     "it they are not written");
  daemon->footer(
      "Example: trunnion daemon --machine mill, then in another terminal: trunnion home, "
      "trunnion monitor\nCtrl-C or SIGTERM stops the motion on its path, then the drives, then the "
      "process.\nExit codes: 0 done, 2 bad tools or variables, 3 bad config, 4 machine fault or already "
      "running, 5 usage.");
  daemon->callback([&exit, options] {
    run_machine(*options);
    exit = Exit::kDone;
  });
}

}  // namespace trn

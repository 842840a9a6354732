#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <memory>
#include <optional>
#include <string_view>

#include "app/cli/commands.h"
#include "app/cli/run_inputs.h"
#include "app/lab/plan_preview.h"
#include "app/lab/run_pictures.h"
#include "app/lab/run_recorder.h"
#include "app/lab/run_report.h"
#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "app/session/program_log.h"
#include "app/session/session_log.h"
#include "app/session/simulation.h"
#include "app/session/stretch_export.h"
#include "app/session/trace.h"
#include "core/fault.h"
#include "core/ports.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/interpreter.h"
#include "interp/gcode/parameter_file.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "interp/plan/stages.h"
#include "kernel/rt_messages.h"

namespace trn {

namespace {

struct RunOptions {
  std::string program, machine, trace, path, stretches, pictures, tools, variables, script, log, logs,
      project, preview;
  int trace_density = 1;
  bool json = false, trace_corrections = false, single_block = false, files = false;
  std::uint32_t from_line = 0;
  double stop_after_s = 0;  ///< 0: not given
};

constexpr double kEndlessShown_s = 3600;  // of motion, where the check has found no end
constexpr double kPathStep = 0.05;        // of the path parameter, in --path

/// Collects the pieces of a stretch, and writes its joint path and a line about it when it is planned.
class PathExport {
 public:
  PathExport(const std::string& path_file, const std::string& stretch_file, const Assembly& assembly)
      : writer_(out_, assembly.machine.joints), map_(*assembly.map) {
    open(path_file, out_);
    open(stretch_file, stretches_);
    if (stretches_.is_open()) stretches_ << "stretch,line,time_s,tip_mm,feed_mm_s\n";
  }
  void piece(const PlanPiece& piece) { stretch_.push_back(piece); }
  void planned(double time_s) {
    if (out_.is_open()) writer_.write(stretch_, map_, kPathStep);
    if (stretches_.is_open()) write_feeds(time_s);
    stretch_.clear();
    ++count_;
  }

 private:
  static void open(const std::string& file, std::ofstream& out) {
    if (file.empty()) return;
    out.open(file);
    if (!out) throw std::runtime_error(fmt::format("{}: cannot write", file));
  }

  // One row for each part of the stretch that has one feed.
  void write_feeds(double time_s) {
    for (std::size_t i = 0; i < stretch_.size();) {
      const PlanPiece& first = stretch_[i];
      double tip_mm = 0;
      for (; i < stretch_.size() && stretch_[i].feed.tip_mm_s == first.feed.tip_mm_s; ++i)
        tip_mm += tip_length(stretch_[i].piece);
      stretches_ << fmt::format("{},{},{:.17g},{:.17g},{:.17g}\n", count_, first.source.line, time_s, tip_mm,
                                first.feed.tip_mm_s);
    }
  }

  std::ofstream out_, stretches_;
  StretchWriter writer_;
  const JointMap& map_;
  std::vector<PlanPiece> stretch_;
  std::uint64_t count_ = 0;
};

/// Hands every report to those that want it.
class Watchers final : public ReportSink {
 public:
  void add(ReportSink& sink) { sinks_.push_back(&sink); }
  bool any() const { return !sinks_.empty(); }
  void write(const CycleReport& report) override {
    for (ReportSink* sink : sinks_) sink->write(report);
  }

 private:
  std::vector<ReportSink*> sinks_;
};

/// One line on a terminal, rewritten in place.
class ProgressLine {
 public:
  explicit ProgressLine(std::uint64_t lines) : lines_(lines), on_(isatty(STDERR_FILENO) != 0) {}
  ~ProgressLine() {
    if (shown_) fmt::print(stderr, "\r\033[K");
  }
  void show(std::uint32_t line, double time_s) {
    if (!on_) return;
    shown_ = true;
    const double share = lines_ ? std::min(1.0, static_cast<double>(line) / static_cast<double>(lines_)) : 0;
    const int full = static_cast<int>(share * kWidth);
    fmt::print(stderr, "\r[{:#<{}}{:.<{}}] {:3.0f} %  line {}  {:.1f} s of motion", "", full, "",
               kWidth - full, 100 * share, line, time_s);
  }

 private:
  static constexpr int kWidth = 30;
  std::uint64_t lines_;
  bool on_, shown_ = false;
};

// For the operator's page, which shows a program before it runs. Its host has other work, and a program may
// ask for more memory than there is.
Exit preview_program(const RunOptions& options, const Assembly& assembly) {
  constexpr rlim_t kMemory = rlim_t{3} << 30, kSeconds = 600;
  constexpr int kNice = 10;
  const rlimit memory{kMemory, kMemory}, time{kSeconds, kSeconds};
  setrlimit(RLIMIT_AS, &memory);
  setrlimit(RLIMIT_CPU, &time);
  if (nice(kNice) < 0) fmt::print(stderr, "the plan is made with the priority of every other program\n");
  Parameters parameters;
  ToolTable tools;
  if (!options.variables.empty()) load_parameters(options.variables, parameters);
  if (!options.tools.empty()) tools = ToolTable::load(options.tools);
  ProgramStart start{options.program, std::nullopt, standing_joints(assembly)};
  start.from_line = options.from_line;
  start.switches = ProgramSwitches::of(assembly);
  PreviewOptions preview;
  if (options.stop_after_s > 0) preview.time_max_s = options.stop_after_s;
  const PlanPreview plan = preview_plan(assembly, parameters, tools, start, preview);
  write_plan(options.preview, plan, assembly.machine, options.program);
  if (plan.message.empty()) return Exit::kDone;
  fmt::print(stderr, "{}\n", plan.message);
  return Exit::kBadProgram;
}

Exit simulate_program(const RunOptions& options, Assembly& assembly) {
  Parameters parameters;
  ToolTable tools;
  if (!options.variables.empty()) load_parameters(options.variables, parameters);
  if (!options.tools.empty()) tools = ToolTable::load(options.tools);

  // The whole program is judged before anything moves.
  ProgramStart start{options.program, std::nullopt, standing_joints(assembly)};
  start.from_line = options.from_line;
  start.switches = ProgramSwitches::of(assembly);
  const ProgramSummary checked = check_program(assembly, parameters, tools, start, {});
  if (options.from_line > 1) fmt::print(stderr, "{}", approach_text(options.from_line, checked.approach));
  fmt::print(stderr, "{}", remark_on(checked));

  ProgressLine progress(checked.lines);
  std::optional<TraceWriter> trace;
  std::optional<PathExport> path;
  if (!options.trace.empty())
    trace.emplace(options.trace, assembly.machine, *assembly.map, *assembly.corrections.setpoint,
                  options.trace_corrections);
  if (!options.path.empty() || !options.stretches.empty())
    path.emplace(options.path, options.stretches, assembly);
  std::unique_ptr<SessionLog> log;
  if (!options.log.empty())
    log = std::make_unique<SessionLog>(options.log,
                                       session_head(options.machine, options.tools, options.variables, true));
  SimulationOptions simulation;
  if (!options.script.empty()) simulation.script = read_operator_script(options.script);
  simulation.single_block = options.single_block;
  if (checked.endless != 0) simulation.stop_after_s = kEndlessShown_s;
  if (options.stop_after_s > 0) simulation.stop_after_s = options.stop_after_s;
  simulation.log = log.get();
  simulation.program = options.program;
  simulation.from_line = options.from_line;
  Watchers watchers;
  RunRecorder recorder(assembly.machine, *assembly.map);
  if (trace) watchers.add(*trace);
  if (!options.pictures.empty()) watchers.add(recorder);
  if (watchers.any()) simulation.trace = &watchers;
  simulation.histograms = !options.pictures.empty();
  if (path) simulation.on_piece = [&](const PlanPiece& piece) { path->piece(piece); };
  if (path) simulation.on_stretch = [&](double time_s) { path->planned(time_s); };
  simulation.on_warning = [](const Diagnostic& warning) { fmt::print(stderr, "{}\n", warning.text); };
  simulation.on_tool = [&](std::uint32_t line, int number) {
    fmt::print(stderr, "{}:{}: M6: {} counts as put in\n", options.program, line, tool_name(tools, number));
  };
  simulation.on_message = [](std::string_view text, std::uint32_t) { fmt::print(stderr, "{}\n", text); };
  ProgramLog program_log(options.logs, [](const std::string& text) { fmt::print(stderr, "{}\n", text); });
  simulation.on_log = [&](const canon::Log& written, std::uint32_t line) { program_log.take(written, line); };
  simulation.progress = [&](std::uint32_t line, double time_s) { progress.show(line, time_s); };
  const SimulationResult result = simulate(assembly, parameters, tools, simulation);
  if (trace) trace->close();
  if (!options.pictures.empty())
    write_run_pictures(options.pictures, options.program, assembly.machine, recorder.bins(), result);
  if (!options.variables.empty()) save_parameters(options.variables, parameters);

  const auto report = options.json ? run_json : run_summary;
  fmt::print("{}", report(result, assembly.machine, options.program));
  const std::string health = assembly.drives->health();
  if (!options.json && !health.empty()) fmt::print("  bus              {}\n", health);
  const std::string broken = broken_promises(result, assembly.machine);
  fmt::print(stderr, "{}", broken);
  if (result.fault == Fault::kOk) return broken.empty() ? Exit::kDone : Exit::kMachineFault;
  const FaultInfo& fault = fault_info(result.fault);
  fmt::print(stderr, "fault {}: {}; {}\n", fault.name, fault.meaning, fault.remedy);
  const std::string check = explain(result.failed_check);
  const std::string detail = check.empty() ? assembly.drives->explain_fault(-1) : check;
  if (!detail.empty()) fmt::print(stderr, "{}\n", detail);
  return Exit::kMachineFault;
}

Exit run(RunOptions options) {
  const RunInputs inputs =
      complete_inputs({options.program, options.machine, options.tools}, options.project);
  if (inputs.program.empty()) throw CLI::RequiredError("program");
  if (inputs.machine.empty())
    throw CLI::RequiredError("--machine, or a comment (machine: FILE.toml) in the program's first lines,");
  options.program = inputs.program;
  options.machine = inputs.machine;
  options.tools = inputs.tools;
  if (options.files) {
    fmt::print("{}\n{}\n{}\n", inputs.program, inputs.machine, inputs.tools);
    return Exit::kDone;
  }
  Assembly assembly = assemble(options.machine);
  if (options.trace_density > 1) set_period(assembly, assembly.machine.period_s / options.trace_density);
  return options.preview.empty() ? simulate_program(options, assembly) : preview_program(options, assembly);
}

}  // namespace

void add_run(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command = app.add_subcommand("run",
                                         "Run a program on simulated drives, faster than real time, and tell "
                                         "how it went. The program is checked "
                                         "to its end first; with an error in it nothing moves.");
  command->add_option("program", options->program, "G-code file");
  command->add_option(
      "--machine", options->machine,
      "machine config (.toml); without it the one that a comment of the program's first lines "
      "names, relative to its folder: (machine: ../configs/mill.toml; tools: tools.tbl)");
  command->add_option(
      "--project", options->project,
      "the project's folder, as run.sh gives it: files not found from here are looked for in it, "
      "examples by their name alone; without a program its impeller, without a machine its cradle");
  command->add_flag("--files", options->files,
                    "print where program, machine and tools are found, a line each, and run nothing");
  command->add_option("--trace", options->trace, "write the setpoints of every period (CSV)");
  command->add_flag("--trace-corrections", options->trace_corrections,
                    "in the trace, also what each correction adds to each joint");
  command
      ->add_option("--trace-density", options->trace_density,
                   "sample the same motion this many times per period, in trace and summary")
      ->check(CLI::Range(1, 100));
  command->add_option(
      "--path", options->path,
      "write the joint path that was planned, s,joints...,tip, a blank line between stretches");
  command->add_option(
      "--stretches", options->stretches,
      "write the stretches between full stops: planned time, length of tip path at each feed (CSV)");
  command->add_option(
      "--report", options->pictures,
      "write pictures of the run into this folder: report.html, which needs nothing else, and each as "
      "SVG: speed, joints, path, deviation");
  command->add_option(
      "--preview", options->preview,
      "plan only, without drives, and write what the operator's page draws: the tip's way, its speed and "
      "the joint that limits it; also of a program with an error, up to there");
  command->add_option("--tools", options->tools, "tool table (.tbl); without it as --machine");
  command->add_option("--vars", options->variables,
                      "variables (.var), read before and written after the run");
  command
      ->add_option("--from", options->from_line,
                   "begin at this line of the program: the lines before it set modes, offsets and tool "
                   "without moving, the machine goes to where they end (up to [program] safe_z_mm, across, "
                   "down), then the program goes on")
      ->check(CLI::PositiveNumber);
  command
      ->add_option(
          "--stop-after", options->stop_after_s,
          "stop once the motion has taken so many seconds; 3600 for a program that goes round for ever, as "
          "with M99 at its end")
      ->check(CLI::PositiveNumber);
  command->add_option("--operator", options->script,
                      "what the operator does: lines of SECONDS ACTION [VALUE] with hold, resume, stop, "
                      "override, rapid, spindle, adaptive (percent), step on|off; # begins a comment");
  command->add_flag("--step", options->single_block,
                    "single block: stand on the path at the end of every line, then go on at once");
  command->add_option("--log", options->log, "write the session to this file, for 'trunnion replay'");
  command->add_option(
      "--logs", options->logs,
      "folder for the files that the program writes by (LOGOPEN,NAME) and (LOG,TEXT); without it "
      "they are not written");
  command->add_flag("--json", options->json, "summary as JSON (mm, rad, s)");
  command->callback([options, &exit] { exit = run(*options); });
}

}  // namespace trn

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string_view>

#include "app/cli/browser.h"
#include "app/cli/commands.h"
#include "app/cli/named_files.h"
#include "app/cli/run_inputs.h"
#include "app/cli/run_page.h"
#include "app/lab/plan_preview.h"
#include "app/lab/run_pictures.h"
#include "app/lab/run_recorder.h"
#include "app/lab/run_report.h"
#include "app/lab/text_file.h"
#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "app/session/plausibility.h"
#include "app/session/program_log.h"
#include "app/session/session_log.h"
#include "app/session/simulation.h"
#include "app/session/stretch_export.h"
#include "app/session/trace.h"
#include "core/fault.h"
#include "core/machine.h"
#include "core/ports.h"
#include "core/safe_file.h"
#include "core/sanitizer.h"
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
    if (!out) throw OutputError(fmt::format("{}: cannot write this file: {}", file, std::strerror(errno)));
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

/// What a program begins with.
struct Begin {
  Begin(const RunOptions& options, const Assembly& assembly)
      : start{options.program, std::nullopt, standing_joints(assembly)} {
    if (!options.variables.empty()) load_parameters(options.variables, parameters);
    if (!options.tools.empty()) tools = ToolTable::load(options.tools);
    start.from_line = options.from_line;
    start.switches = ProgramSwitches::of(assembly);
    check_start(assembly, start.q);
  }
  Parameters parameters;
  ToolTable tools;
  ProgramStart start;
};

PlanPreview plan_of(const RunOptions& options, const Assembly& assembly) {
  Begin begin(options, assembly);
  PreviewOptions preview;
  if (options.stop_after_s > 0) preview.time_max_s = options.stop_after_s;
  return preview_plan(assembly, begin.parameters, begin.tools, begin.start, preview);
}

// For the operator's page, which shows a program before it runs. Its host has other work, and a program may
// ask for more memory than there is.
Exit preview_program(const RunOptions& options, const Assembly& assembly) {
  constexpr rlim_t kMemory = rlim_t{3} << 30, kSeconds = 600;
  constexpr int kNice = 10;
  const rlimit memory{kMemory, kMemory}, time{kSeconds, kSeconds};
  if (!kSanitized) setrlimit(RLIMIT_AS, &memory);
  setrlimit(RLIMIT_CPU, &time);
  if (nice(kNice) < 0) fmt::print(stderr, "the plan is made with the priority of every other program\n");
  check_text_file(options.preview);
  const PlanPreview plan = plan_of(options, assembly);
  write_plan(options.preview, plan, assembly.machine, options.program);
  if (plan.message.empty()) return Exit::kDone;
  fmt::print(stderr, "{}\n", plan.message);
  return Exit::kBadProgram;
}

void print_drives(const Drives& drives, bool json) {
  const std::string health = drives.health();
  if (!json && !health.empty()) fmt::print("  bus              {}\n", health);
  for (const std::string& warning : drives.warnings()) fmt::print(stderr, "warning: {}\n", warning);
}

// The end of the summary: what it was, and what to try next.
void tell_people(const RunOptions& options, const SimulationResult& result, const Machine& machine) {
  const std::string page = options.pictures.empty() ? "" : options.pictures + "/report.html";
  if (options.json) {
    if (!page.empty()) fmt::print(stderr, "pictures: {}\n", page);
    return;
  }
  fmt::print("{}", run_sentence(result, machine, options.program));
  if (page.empty())
    fmt::print("Next: see where, with --report pictures (speed, joints, path, deviation).\n");
  else if (open_in_browser(page))
    fmt::print("Pictures: {}; your browser shows them.\n", page);
  else
    fmt::print("Pictures: {}; open it in a browser.\n", page);
}

Exit tell_result(const RunOptions& options, const Assembly& assembly, const SimulationResult& result) {
  const auto report = options.json ? run_json : run_summary;
  fmt::print("{}", report(result, assembly.machine, options.program));
  print_drives(*assembly.drives, options.json);
  const std::string broken = broken_promises(result, assembly.machine);
  fmt::print(stderr, "{}", broken);
  tell_people(options, result, assembly.machine);
  if (result.fault == Fault::kOk) return broken.empty() ? Exit::kDone : Exit::kMachineFault;
  const FaultInfo& fault = fault_info(result.fault);
  fmt::print(stderr, "fault {}: {}; {}\n", fault.name, fault.meaning, fault.remedy);
  const std::string check = explain(result.failed_check);
  const std::string detail = check.empty() ? assembly.drives->explain_fault(-1) : check;
  if (!detail.empty()) fmt::print(stderr, "{}\n", detail);
  return Exit::kMachineFault;
}

Exit simulate_program(const RunOptions& options, Assembly& assembly) {
  Begin begin(options, assembly);
  ToolTable& tools = begin.tools;
  // The whole program is judged before anything moves.
  const ProgramSummary checked = check_program(assembly, begin.parameters, tools, begin.start, {});
  if (options.from_line > 1) fmt::print(stderr, "{}", approach_text(options.from_line, checked.approach));
  fmt::print(stderr, "{}", remark_on(checked));

  for (const std::string& folder : {options.pictures, options.logs})
    if (!folder.empty()) make_result_folder(folder);
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
  // Before the run, which may change parameters and tools.
  std::optional<PlanPreview> plan;
  if (!options.pictures.empty() && checked.endless == 0) plan = plan_of(options, assembly);
  const SimulationResult result = simulate(assembly, begin.parameters, tools, simulation);
  if (trace) trace->close();
  if (const std::string trouble = log ? log->take_trouble() : ""; !trouble.empty())
    throw OutputError(trouble);
  if (!options.pictures.empty())
    write_run_pictures(options.pictures, options.program, assembly.machine, recorder.bins(), result);
  if (plan && write_run_page(options.pictures, options.program, assembly.machine, *plan) && !options.json)
    fmt::print("The path in three dimensions: {}/path.html\n", options.pictures);
  if (!options.variables.empty()) save_parameters(options.variables, begin.parameters);

  return tell_result(options, assembly, result);
}

Exit run(RunOptions options) {
  if (options.project.empty()) options.program = with_examples(options.program);
  const RunInputs inputs =
      complete_inputs({options.program, options.machine, options.tools}, options.project);
  if (inputs.program.empty()) throw CLI::RequiredError("program");
  check_inputs(inputs);
  options.program = inputs.program;
  options.machine = inputs.machine;
  options.tools = inputs.tools;
  if (options.files) {
    fmt::print("{}\n{}\n{}\n", inputs.program, inputs.machine, inputs.tools);
    return Exit::kDone;
  }
  Assembly assembly = assemble(options.machine);
  for (const std::string& question : implausible(assembly.machine, *assembly.kinematics))
    fmt::print(stderr, "is this right? {}\n", question);
  if (options.trace_density > 1) set_period(assembly, assembly.machine.period_s / options.trace_density);
  return options.preview.empty() ? simulate_program(options, assembly) : preview_program(options, assembly);
}

}  // namespace

void add_run(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command =
      app.add_subcommand("run",
                         "Run a program on simulated drives, faster than real time, and tell how it went. "
                         "The program is checked to its end first. With an error in it nothing moves.");
  command->add_option("program", options->program, "G-code file; or an example by its name: impeller");
  command->add_option(
      "--machine,-m", options->machine,
      "the machine by its name, as mill, or its config (.toml). Without it, the program's first "
      "lines name it: (machine: mill), or a file relative to the program's folder: (machine: "
      "../configs/mill.toml; tools: tools.tbl)");
  command->add_option("--project", options->project,
                      "the project's folder, which run.sh gives. Files that are not here are looked for "
                      "there. Without a program its impeller is run, without a machine its cradle");
  command->add_flag("--files", options->files,
                    "print where program, machine and tools are found, a line each; nothing is run");
  command->add_option("--trace", options->trace, "write the setpoints of every period (CSV)");
  command->add_flag("--trace-corrections", options->trace_corrections,
                    "write what each correction adds to each joint into the trace, too");
  command
      ->add_option("--trace-density", options->trace_density,
                   "sample the motion this many times a period, in trace and summary")
      ->check(CLI::Range(1, 100));
  command->add_option("--path", options->path,
                      "write the planned path of joints and tip; a blank line stands between stretches");
  command->add_option(
      "--stretches", options->stretches,
      "write a line for each stretch between full stops: planned time, and tip path at each feed (CSV)");
  command->add_option(
      "--report", options->pictures,
      "draw the run into this folder: report.html, which needs nothing else, and each picture as SVG: "
      "speed, joints, path, deviation. In a terminal with a display the browser shows it");
  command->add_option(
      "--preview", options->preview,
      "plan only, without drives, and write what the operator's page draws: the tip's way, its speed and "
      "the joint that limits it. A program with an error is planned up to there");
  command->add_option("--tools", options->tools,
                      "tool table (.tbl). Without it, the program's first lines name it, as with --machine");
  command->add_option("--vars", options->variables,
                      "variables (.var), read before and written after the run");
  command
      ->add_option("--from", options->from_line,
                   "begin at this line. The lines before it set modes, offsets and tool without motion. Then "
                   "the machine goes to where they end: up to [program] safe_z_mm, across, down")
      ->check(CLI::PositiveNumber);
  command
      ->add_option(
          "--stop-after", options->stop_after_s,
          "stop after so many seconds of motion. A program without an end (M99 at its end) stops after 3600")
      ->check(CLI::PositiveNumber);
  command->add_option("--operator", options->script,
                      "a file of what the operator does, lines of SECONDS ACTION [VALUE]: hold, resume, "
                      "stop, step on|off; override, rapid, spindle, adaptive in percent. # begins a comment");
  command->add_flag("--step", options->single_block,
                    "single block: stand still at the end of every line, then go on at once");
  command->add_option("--log", options->log, "write the session to this file, for 'trunnion replay'");
  command->add_option("--logs", options->logs,
                      "folder for the files that the program writes with (LOGOPEN,NAME) and (LOG,TEXT). "
                      "Without it they are not written");
  command->add_flag("--json", options->json, "summary as JSON (mm, rad, s)");
  command->callback([options, &exit] { exit = run(*options); });
}

}  // namespace trn

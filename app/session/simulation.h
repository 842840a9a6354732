#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "app/check/deviation_meter.h"
#include "app/check/limit_judge.h"
#include "app/session/assembly.h"
#include "app/session/feature_meter.h"
#include "app/session/operator_script.h"
#include "app/session/pipeline.h"
#include "app/session/session_log.h"
#include "core/axes.h"
#include "core/check.h"
#include "core/fault.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/interpreter.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"
#include "interp/plan/speed/speed_options.h"
#include "interp/plan/stages.h"
#include "kernel/cycle.h"
#include "kernel/rt_messages.h"
#include "sim/simulated_screws.h"

namespace trn {

struct SimulationOptions {
  std::string program;                      ///< file; or the name that stands for `program_text`
  std::optional<std::string> program_text;  ///< the program itself
  std::uint32_t from_line = 0;              ///< as ProgramStart::from_line
  std::vector<OperatorAction> script;       ///< in order of time
  double stop_after_s = std::numeric_limits<double>::infinity();  ///< of motion; the run stops then
  bool single_block = false;  ///< stands at the end of every line, and goes on at once
  SessionLog* log = nullptr;
  ReportSink* trace = nullptr;
  bool histograms = false;  ///< of the deviations
  std::function<void(const ProgramMove&)> on_move;
  std::function<void(const PlanPiece&)> on_piece;
  std::function<void(std::string_view, std::uint32_t)> on_message;  ///< as PipelineObservers::message
  std::function<void(const canon::Log&, std::uint32_t)> on_log;     ///< as PipelineObservers::log
  std::function<void(double time_s)> on_stretch;                    ///< as PipelineObservers::stretch
  std::function<void(const Diagnostic&)> on_warning;
  std::function<void(std::uint32_t line, int tool)> on_tool;  ///< a tool counts as put in that M6 waits for
  std::function<void(std::uint32_t line, double time_s)> progress;
};

/// How long a joint spent at 95 % or more of a limit, s.
struct TimeAtLimit {
  double velocity = 0, acceleration = 0, jerk = 0;
};

/// What a correction did in a run.
struct CorrectionSummary {
  std::string name;
  double peak_mm = 0, peak_rad = 0;           ///< greatest offset of a linear, of a rotary joint
  double left_tip_mm = 0, left_axis_rad = 0;  ///< geometric: greatest error that was left
  std::string warning;                        ///< the last one
};

struct SimulationResult {
  double cycle_time_s = 0;  ///< first to last motion, dwells included
  double wall_s = 0;
  double path_mm = 0;  ///< way of the tip in the work
  std::uint64_t lines = 0, periods = 0;
  std::uint32_t starvations = 0;
  std::vector<JointVerdict> joints;
  std::vector<TimeAtLimit> at_limit;
  double free_s = 0;    ///< no joint at a limit: the feed decides
  double geared_s = 0;  ///< the motion follows the spindle, or waits for its index
  bool within_limits = false;
  DeviationReport deviation;
  SpeedStats speed;
  double planning_s = 0;                        ///< processor time of interpreter and planner
  std::vector<CorrectionSummary> corrections;   ///< in the order of the chain
  std::vector<SimulatedScrews::Report> screws;  ///< how warm they became, and what that did
  std::vector<FeatureDeflection> features;      ///< empty unless the machine estimates the tool's load
  std::optional<std::uint32_t> stopped_at;      ///< the line, where the program was not run to its end
  Fault fault = Fault::kOk;
  int fault_joint = -1;
  CheckFailure failed_check;  ///< behind the fault `assertion`
};

/// ConfigError if the machine would begin at joints from which no program can: nobody can jog it away there.
void check_start(const Assembly& assembly, const JointVec& q);

/// Runs a program on simulated drives with a virtual clock: brings up and homes the drives, then ticks as
/// fast as it can, with planning ahead of every tick. Deterministic. ProgramError as Pipeline.
SimulationResult simulate(Assembly& assembly, Parameters& parameters, ToolTable& tools,
                          const SimulationOptions& options);

}  // namespace trn

#include "app/session/trace.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/axes.h"
#include "core/plain_file.h"
#include "core/safe_file.h"

namespace trn {

namespace {

std::string correction_columns(const Machine& machine, const SetpointChain& chain) {
  std::vector<std::string> names{"geometric", "joint_table"};
  for (int i = 0; i < chain.size(); ++i) names.push_back(chain.budget(i).name);
  std::string out;
  for (const std::string& name : names)
    for (const Joint& joint : machine.joints) out += "," + name + "." + joint.name;
  return out;
}

std::FILE* open_trace(const std::string& path) {
  constexpr unsigned kMode = 0666;  // as the user's mask leaves it
  try {
    const int fd = open_to_write(path, kMode);
    if (std::FILE* const file = fdopen(fd, "w")) return file;
    close(fd);
    throw PlainFileError(std::strerror(errno));
  } catch (const PlainFileError& error) {
    throw OutputError(fmt::format("{}: cannot write the trace: {}", path, error.what()));
  }
}

}  // namespace

TraceWriter::TraceWriter(const std::string& path, const Machine& machine, const MachineJointMap& map,
                         const SetpointChain& chain, bool corrections, bool pieces)
    : path_(path),
      map_(map),
      chain_(chain),
      corrections_(corrections),
      pieces_(pieces),
      period_s_(machine.period_s),
      file_(open_trace(path)) {
  std::string header = "t_s";
  for (const Joint& joint : machine.joints) header += "," + joint.name;
  header += ",p_x,p_y,p_z,u_i,u_j,u_k,line";
  if (chain_.deflection()) header += ",force.X,force.Y,deflection.X,deflection.Y,load_known";
  if (corrections_) header += correction_columns(machine, chain_);
  if (pieces_) header += ",piece";
  header += "\n";
  std::fputs(header.c_str(), file_.get());
}

void TraceWriter::write(const CycleReport& report) {
  // The stream begins with the last period at rest, so that traces of the same program begin alike however
  // long the machine stood before.
  const bool at_work = report.motion == MotionState::kMoving || report.motion == MotionState::kHeld ||
                       report.motion == MotionState::kJogging || report.motion == MotionState::kPaused;
  if (!any_ && !at_work) {
    if (!standing_) standing_ = std::make_unique<CycleReport>();
    *standing_ = report;
    return;
  }
  if (!any_) {
    any_ = true;
    first_period_ = standing_ ? standing_->period : report.period;
    if (standing_) {
      standing_->context = report.context;
      row(*standing_);
    }
  }
  if (without_power_) ++piece_;
  without_power_ = false;
  row(report);
}

void TraceWriter::power_lost() {
  standing_.reset();
  if (!pieces_ || !any_ || without_power_) return;
  without_power_ = true;
  ++piece_;
  emit(last_period_ + 1);
}

void TraceWriter::row(const CycleReport& report) {
  text_.clear();
  auto out = std::back_inserter(text_);
  for (const double value : report.q_setpoint) fmt::format_to(out, ",{:.17g}", value);
  ToolPose pose;
  if (tool_pose(map_, report.q_plan, report.context, pose) == KinStatus::kOk)
    fmt::format_to(out, ",{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}", pose.p_W[0], pose.p_W[1],
                   pose.p_W[2], pose.u_W[0], pose.u_W[1], pose.u_W[2]);
  else
    text_ += ",0,0,0,0,0,0";
  fmt::format_to(out, ",{}", report.line);
  if (chain_.deflection()) append_tool_load(report.tool_load);
  if (corrections_) append_corrections(report);
  emit(report.period);
}

// What stands in text_, with the time before it.
void TraceWriter::emit(std::uint64_t period) {
  last_period_ = period;
  const std::string time = fmt::format("{:.17g}", static_cast<double>(period - first_period_) * period_s_);
  const std::string end = pieces_ ? fmt::format(",{}\n", piece_) : "\n";
  for (const std::string& part : {time, text_, end}) std::fwrite(part.data(), 1, part.size(), file_.get());
}

void TraceWriter::append_tool_load(const ToolLoadReport& load) {
  fmt::format_to(std::back_inserter(text_), ",{:.9g},{:.9g},{:.9g},{:.9g},{}", load.force_N.x(),
                 load.force_N.y(), load.deflection_mm.x(), load.deflection_mm.y(),
                 load.alarm ? 2 : (load.known ? 1 : 0));
}

void TraceWriter::append_corrections(const CycleReport& report) {
  const auto append = [&](const JointVec& offset) {
    for (const double value : offset) fmt::format_to(std::back_inserter(text_), ",{:.9g}", value);
  };
  MachineJointMap::Parts parts;
  map_.parts(report.y, report.context, parts);
  append(parts.pose);
  append(parts.joint);
  for (int i = 0; i < chain_.size(); ++i) append(report.corrections[static_cast<std::size_t>(i)].offset);
}

void TraceWriter::close() {
  if (std::fflush(file_.get()) != 0 || std::ferror(file_.get()))
    throw OutputError(fmt::format("{}: the trace could not be written whole", path_));
}

}  // namespace trn

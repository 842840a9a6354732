#include "app/session/program_step.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/frames.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/program_config.h"
#include "interp/move.h"

namespace trn {

namespace {

template <std::size_t n>
void put_text(std::string_view text, std::array<char, n>& out) {
  std::copy_n(text.begin(), std::min(text.size(), n - 1), out.begin());
}

// Whole folders from the end, as far as there is room.
std::string_view end_of_path(std::string_view path, std::size_t room) {
  while (path.size() > room) {
    const std::size_t slash = path.find('/', 1);
    if (slash == std::string_view::npos) return path.substr(path.size() - room);
    path = path.substr(slash + 1);
  }
  return path;
}

struct NoMoves : MoveSink {
  void move(const ProgramMove&) override {}
  void event(const QueueEvent&, SourceLine) override {}
};

}  // namespace

ProgramStep step_of(const Interpreter& interpreter, const Lowering& lowering, const ToolTable& tools,
                    SourceLine source, const ProgramMove* move) {
  ProgramStep step;
  step.source = source;
  step.block = interpreter.blocks();
  step.moves = move != nullptr;
  step.rapid = move && move->kind == ProgramMove::Kind::kTraverse;
  step.arc = move && move->kind == ProgramMove::Kind::kArc;
  if (move) step.to = move->to;
  if (move) step.length_mm = tip_length_mm(*move);
  step.context = lowering.context();
  step.frame = lowering.frame();
  step.settings = interpreter.settings();
  if (move) step.settings.motion = interpreter.motion();
  step.cutter_comp = interpreter.cutter_comp();
  if (const Tool* tool = tools.find(step.settings.current_tool)) step.tool_radius_mm = tool->diameter / 2;
  // Cutter compensation holds moves back: then the interpreter has gone on to another line.
  if (source.line == interpreter.line()) put_text(interpreter.text(), step.text);
  put_text(end_of_path(interpreter.file_name(), step.file.size() - 1), step.file);
  return step;
}

ProgramStep idle_step(const Assembly& assembly, Parameters parameters, ToolTable tools,
                      const Settings* kept) {
  NoMoves nowhere;
  const ProgramConfig& config = assembly.program;
  Lowering lowering(config, assembly.kinematics.get(), nowhere);
  Interpreter interpreter({config, parameters, tools, assembly.kinematics.get(), lowering, {}});
  interpreter.open_text("", "", {}, kept);
  return step_of(interpreter, lowering, tools, {}, nullptr);
}

double tip_length_mm(const ProgramMove& move) {
  const Vec3 way = (move.to - move.from).head<3>();
  if (move.kind != ProgramMove::Kind::kArc) return way.norm();
  const Vec3 r = move.from.head<3>() - move.arc_centre;
  const Vec3 radial = r - move.arc_axis * move.arc_axis.dot(r);
  return std::hypot(radial.norm() * move.arc_sweep_rad, move.arc_axis.dot(way));
}

KinStatus words_in(const MachineJointMap& map, const JointVec& q, const MapContext& context, Words& words) {
  if (!context.rtcp) return map.words_at(q, context, words);
  ToolPose pose;
  KinStatus status = tool_pose(map, q, context, pose);
  if (status == KinStatus::kOk) status = map.words_at(q, context.corrections_off, words);
  if (status == KinStatus::kOk) words.head<3>() = pose.p_B;
  return status;
}

ShownPosition shown_position(const MachineJointMap& map, const ProgramStep& step, const JointVec& q,
                             bool on_path, const Words& y) {
  ShownPosition out;
  Words words = Words::Zero();
  if (map.words_at(q, step.context.corrections_off, words) == KinStatus::kOk)
    out.machine = in_degrees<MachineWords>(words);
  words = y;
  if (!on_path && words_in(map, q, step.context, words) != KinStatus::kOk) return out;
  out.work = step.frame.mm_of(words);
  if (step.moves && on_path) out.to_go = step.frame.mm_of(step.to) - out.work;
  return out;
}

}  // namespace trn

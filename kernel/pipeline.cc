#include "kernel/pipeline.h"

#include <fmt/format.h>

#include "core/units.h"
#include "kinematics/platform_kinematics.h"

namespace trn {

namespace {

Words start_words(const MachineJointMap& map, const JointVec& q) {
  Words words = Words::Zero();
  if (map.words_at(q, words) != KinStatus::kOk)
    throw ProgramError("the machine stands where its own position has no axis words; jog it away first");
  return words;
}

AxisValues in_degrees(const Words& words) {
  AxisValues values = words;
  values.tail<3>() *= kDegPerRad;
  return values;
}

void open(Interpreter& interpreter, const ProgramStart& start, const Words& words) {
  if (start.text)
    interpreter.open_text(*start.text, start.path, in_degrees(words), start.kept ? &*start.kept : nullptr);
  else
    interpreter.open(start.path, in_degrees(words));
  if (start.from_line > 1) interpreter.begin_at(start.from_line, in_degrees(words));
}

// A planner's message begins with "line N:"; the file belongs in front of it.
std::string with_file(const std::string& file, const std::string& message) {
  constexpr std::string_view kLine = "line ";
  if (message.rfind(kLine, 0) == 0) return fmt::format("{}:{}", file, message.substr(kLine.size()));
  return message;
}

ProgramConfig for_mdi(ProgramConfig config, bool mdi) {
  if (mdi) config.require_program_end = false;
  return config;
}

}  // namespace

struct Pipeline::MoveTee : MoveSink {
  MoveTee(MoveSink& next_in, double tolerance_max, std::function<void(const ProgramMove&)> seen_in)
      : next(next_in), tolerance_mm_max(tolerance_max), seen(std::move(seen_in)) {}
  void move(const ProgramMove& m) override {
    if (m.mode == PathMode::kContinuous && m.tolerance_mm > tolerance_mm_max)
      throw ProgramError(
          fmt::format("line {}: the path tolerance of {:g} mm is larger than the machine's "
                      "tolerance_mm_max of {:g} mm; give G64 a smaller P",
                      m.source.line, m.tolerance_mm, tolerance_mm_max));
    if (seen) seen(m);
    next.move(m);
  }
  void event(const QueueEvent& event, SourceLine source) override { next.event(event, source); }
  MoveSink& next;
  double tolerance_mm_max;
  std::function<void(const ProgramMove&)> seen;
};

struct Pipeline::PieceTee : PieceSink {
  PieceTee(SpeedPlanner& next_in, PipelineObservers& observers)
      : next(next_in), seen(std::move(observers.piece)), planned(std::move(observers.stretch)) {}
  void piece(const PlanPiece& p) override {
    if (seen) seen(p);
    next.piece(p);
    if (!p.ends_stretch) return;
    if (planned) planned(next.stats().time_s - time_before_s);
    time_before_s = next.stats().time_s;
  }
  void event(const QueueEvent& event, std::uint32_t line) override { next.event(event, line); }
  SpeedPlanner& next;
  std::function<void(const PlanPiece&)> seen;
  std::function<void(double)> planned;
  double time_before_s = 0;
};

struct Pipeline::BlockQueue : BlockSink {
  void block(const MotionBlock& b) override {
    if (b.event.kind == QueueEvent::Kind::kProgramEnd && b.segment_count == 0) end_given = true;
    items.push_back(b);
  }
  std::deque<MotionBlock> items;
  bool end_given = false;
};

Pipeline::~Pipeline() = default;

Pipeline::Pipeline(const Assembly& assembly, Parameters& parameters, ToolTable& tools,
                   const ProgramStart& start, PipelineObservers observers)
    : name_(start.path),
      program_(for_mdi(assembly.program, start.text.has_value())),
      blocks_(std::make_unique<BlockQueue>()),
      speed_(assembly.plan_joints, *assembly.map, assembly.planner.speed, *blocks_),
      pieces_(std::make_unique<PieceTee>(speed_, observers)),
      geometry_(assembly.planner.geometry, *pieces_),
      moves_(
          std::make_unique<MoveTee>(geometry_, assembly.planner.tolerance_mm_max, std::move(observers.move))),
      lowering_(program_, assembly.kinematics.get(), *moves_, start_words(*assembly.map, start.q)),
      interpreter_(
          {program_, parameters, tools, assembly.kinematics.get(), lowering_, std::move(observers.warning)}) {
  open(interpreter_, start, start_words(*assembly.map, start.q));
}

bool Pipeline::next(MotionBlock& block) {
  while (blocks_->items.empty() && !ended_) fill();
  if (blocks_->items.empty()) return false;
  block = blocks_->items.front();
  blocks_->items.pop_front();
  return true;
}

void Pipeline::fill() {
  std::string failure;
  try {
    if (interpreter_.step()) return;
  } catch (const GcodeError& error) {
    failure = error.what();  // what came before it still runs to its end
  } catch (const ProgramError& error) {
    end_program();
    throw ProgramError(with_file(name_, error.what()));
  }
  try {
    geometry_.finish();
    speed_.finish();
  } catch (const ProgramError& error) {
    if (failure.empty()) failure = with_file(name_, error.what());
  }
  end_program();
  if (!failure.empty()) throw ProgramError(failure);
}

void Pipeline::end_program() {
  ended_ = true;
  if (blocks_->end_given) return;
  MotionBlock end;
  end.event.kind = QueueEvent::Kind::kProgramEnd;
  end.line = interpreter_.line();
  blocks_->block(end);
}

namespace {

/// Follows moves through the bracket and judges position limits; throws at the first place outside.
class LimitScout : public MoveSink {
 public:
  explicit LimitScout(const Assembly& assembly)
      : assembly_(assembly),
        platform_(dynamic_cast<const PlatformKinematics*>(assembly.kinematics.get()) != nullptr) {}
  void move(const ProgramMove& move) override {
    ++moves;
    if (move.source.line == 0) approach.push_back(move.to);
    if (path_norm(move.to - move.from) == 0 && move.kind != ProgramMove::Kind::kArc) return;
    const bool arc = move.kind == ProgramMove::Kind::kArc;
    const PathPiece piece =
        arc ? make_arc(move.from, move.to, move.arc_centre, move.arc_axis, move.arc_sweep_rad)
            : make_line(move.from, move.to);
    // With RTCP off a straight move takes a serial machine's joints straight: its end is enough. Else joints
    // bend, and may leave their range between two good ends; places every 5 mm do.
    const bool bends = arc || move.context.rtcp || platform_;
    const int parts = bends ? std::clamp(static_cast<int>(piece.length / 5), 1, 200) : 1;
    for (int i = 1; i <= parts; ++i) judge(move, piece.at(piece.length * i / parts));
  }
  void event(const QueueEvent&, SourceLine) override {}
  std::uint64_t moves = 0;
  std::vector<Words> approach;

 private:
  void judge(const ProgramMove& move, const Words& y) {
    JointVec q;
    const KinStatus status = assembly_.map->map(y, move.context, q);
    if (status != KinStatus::kOk)
      throw ProgramError(
          fmt::format("line {}: the machine cannot get there ({}): X{:.4f} Y{:.4f} Z{:.4f}; move "
                      "the work offset or the part",
                      move.source.line, to_string(status), y[0], y[1], y[2]));
    for (std::size_t i = 0; i < assembly_.plan_joints.size(); ++i) {
      const Joint& joint = assembly_.plan_joints[i];
      const double value = q[static_cast<Eigen::Index>(i)];
      if (value >= joint.limit.min - kRounding && value <= joint.limit.max + kRounding) continue;
      const bool rotary = joint.kind == JointKind::kRotary;
      const double unit = rotary ? kDegPerRad : 1.0;
      throw ProgramError(
          fmt::format("line {}: joint {} would go to {:.4f} {}, outside its range {:g} to {:g}; move the "
                      "work offset or the "
                      "part, or change the program",
                      move.source.line, joint.name, value * unit, rotary ? "deg" : "mm",
                      joint.limit.min * unit, joint.limit.max * unit));
    }
  }

  static constexpr double kRounding = 1e-9;
  const Assembly& assembly_;
  bool platform_;
};

}  // namespace

ProgramSummary check_program(const Assembly& assembly, Parameters parameters, ToolTable tools,
                             const ProgramStart& start, const std::function<void(std::uint32_t)>& progress) {
  const ProgramConfig program = for_mdi(assembly.program, start.text.has_value());
  const Words words = start_words(*assembly.map, start.q);
  LimitScout scout(assembly);
  Lowering lowering(program, assembly.kinematics.get(), scout, words);
  Interpreter interpreter({program, parameters, tools, assembly.kinematics.get(), lowering, {}});
  try {
    open(interpreter, start, words);
    std::uint64_t steps = 0;
    while (interpreter.step())
      if (progress && ++steps % 100000 == 0) progress(interpreter.line());
  } catch (const ProgramError& error) {
    throw ProgramError(with_file(start.path, error.what()));
  }
  return {interpreter.line(), scout.moves, scout.approach};
}

}  // namespace trn

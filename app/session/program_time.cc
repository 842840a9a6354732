#include "app/session/program_time.h"

#include <cstdint>
#include <exception>

#include "core/axes.h"
#include "core/motion.h"
#include "core/ports.h"
#include "kernel/joint_map.h"
#include "kernel/motion_queue.h"

namespace trn {

namespace {

constexpr double kLongest_s = 3 * 86400.0;            // who loops for three days has no end
constexpr std::uint64_t kBlockLinesMax = 10'000'000;  // for one block: a loop without motion

}  // namespace

ProgramAnswer guessed_answer(const QueueEvent& event, const MachineJointMap& map, const MotionBlock& last) {
  ProgramAnswer answer;
  if (event.kind == QueueEvent::Kind::kToolChange) answer.value = 1;
  if (event.kind != QueueEvent::Kind::kProbeEnd || last.segment_count == 0) return answer;
  const TimeSegment& end = last.segments[static_cast<std::size_t>(last.segment_count - 1)];
  answer.y_stand = last.piece.at(end.s_at(end.duration_s));
  answer.probe = map.map(answer.y_stand, last.context, answer.q_contact) == KinStatus::kOk;
  answer.value = answer.probe ? 1 : 0;
  return answer;
}

ProgramTime time_program(const Assembly& assembly, Parameters parameters, ToolTable tools, ProgramStart start,
                         const std::atomic<bool>* given_up) {
  ProgramTime out;
  start.ends_round = true;
  try {
    Pipeline pipeline(assembly, parameters, tools, start, {});
    MotionBlock block, last;
    QueueEvent asked;
    while (out.time.total_s() < kLongest_s) {
      if (pipeline.next(block, given_up, kBlockLinesMax)) {
        out.time.add(block);
        if (block.segment_count > 0) last = block;
        asked = block.event;
        out.known = asked.kind == QueueEvent::Kind::kProgramEnd;
        continue;
      }
      if (!pipeline.waiting() || (given_up && *given_up)) break;
      out.about = out.about || asked.kind != QueueEvent::Kind::kToolChange;
      pipeline.answer(guessed_answer(asked, *assembly.map, last));
    }
  } catch (const std::exception&) {  // whoever drives the program tells what is wrong with it
    out.known = false;
  }
  if (given_up && *given_up) out.known = false;
  return out;
}

}  // namespace trn

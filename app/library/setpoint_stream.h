#pragma once

#include <cstdint>

#include "app/library/trunnion.h"
#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"

namespace trn {

/// The setpoints of a program's plan at even times. What the program asks the machine is answered as one
/// would for whom all goes well.
class SetpointStream {
 public:
  /// `assembly` must outlive it. ProgramError as Pipeline.
  SetpointStream(const Assembly& assembly, const ProgramStart& start, Parameters parameters, ToolTable tools,
                 double period_s);
  /// The setpoint of the next period; false behind the last. ProgramError as Pipeline::next.
  bool next(trunnion::Setpoint& setpoint);

 private:
  double element_s() const;
  void take_block();
  void place();
  void derive(const JointMotion& motion, double time_s, double duration_s);
  void write(trunnion::Setpoint& setpoint) const;

  const Assembly& assembly_;
  Parameters parameters_;
  ToolTable tools_;
  Pipeline pipeline_;
  double period_s_;
  std::uint64_t periods_ = 0;
  MotionBlock block_;  ///< the last one with motion
  int segment_ = 0;    ///< of it
  bool dwells_ = false, ended_ = false;
  double dwell_s_ = 0;
  double in_element_s_ = 0;  ///< since the segment, or the dwell, began
  QueueEvent asked_;         ///< the last event
  JointVec q_, qd_, qdd_;
  Words words_ = Words::Zero();
};

}  // namespace trn

#pragma once

#include <cstdint>

#include "core/motion.h"
#include "kernel/interpolator.h"
#include "kernel/motion_queue.h"

namespace trn {

/// Single block: the motion stands at the end of every line of the program until it is released. A line that
/// ends inside a stretch needs a stop of its own (`to_line_end_s`); one that is too short for that runs on
/// into the next, which then counts as released.
class SingleBlock {
 public:
  SingleBlock(MotionQueue& queue, const Interpolator& interpolator)
      : queue_(queue), interpolator_(interpolator) {}

  void set(bool on) TRN_RT;
  bool on() const TRN_RT { return on_; }
  /// A program begins, or what was typed in at the control (MDI), whose lines are not held.
  void begin(bool typed_in) TRN_RT {
    typed_in_ = typed_in;
    begins_ = true;
    seen_ = {};
  }
  /// The next line that the motion meets is released.
  void release() TRN_RT { begins_ = true; }

  /// The released line is driven to its end. `stands`: the motion is at rest.
  bool pauses(bool stands) TRN_RT;
  /// Plan time to the end of the released line, s, if that is in the middle of a stretch and nearer than
  /// `horizon_s`; else kNoStop.
  double to_line_end_s(double horizon_s) const TRN_RT;
  /// What moves now.
  void see(const SourceLine& source) TRN_RT {
    if (source.line == line_) seen_ = source;
  }
  /// What moved last of the released line. `shown`: where nothing of it was seen.
  SourceLine driven(const SourceLine& shown) const TRN_RT {
    return seen_.step > 0 && seen_.line == line_ ? seen_ : shown;
  }
  /// The motion went past the end of the released line: the line that has begun takes its place.
  void pass_line() TRN_RT;

 private:
  const MotionBlock* block_here(std::uint64_t& index) const TRN_RT;
  bool holds() const TRN_RT { return on_ && !typed_in_; }

  MotionQueue& queue_;
  const Interpolator& interpolator_;
  bool on_ = false, begins_ = false, typed_in_ = false;
  std::uint32_t line_ = 0;    ///< that was released
  SourceLine seen_;           ///< of it
  std::uint32_t number_ = 0;  ///< of its last block that was met
};

}  // namespace trn

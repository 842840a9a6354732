#pragma once

#include <limits>
#include <stdexcept>

#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"

// What the interpreter hands to the planner: programmed motion in absolute terms, in program order.
namespace trn {

/// Upper bounds on speed that the program asks for; infinite where it does not. And whether the operator may
/// change it.
struct FeedLimit {
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  double tip_mm_s = kNone;      ///< speed of the tip in the work
  double rotary_rad_s = kNone;  ///< norm of the rotary words' speed; moves without X Y Z motion
  double path_units_s = kNone;  ///< ds/dt, s being the parameter of the piece that has this limit
  OverrideMode overrides;
  double tip_mm_s2 = kNone;  ///< acceleration of the tip, about; exact stops only
};

enum class PathMode : unsigned char {
  kExactStop,   ///< G61.1: stop at the end of every move
  kExactPath,   ///< G61: on the path; stop where the path is not smooth
  kContinuous,  ///< G64: leave the path within the tolerances
};

/// One programmed move. Words are absolute, all offsets applied. RTCP on: X Y Z are the tip in the table
/// frame B, mm. RTCP off: the machine's own axes, still without the tool offset (the joint map adds it). A B
/// C are the program's angles in rad (an axis' sense is the kinematics' business).
struct ProgramMove {
  enum class Kind : unsigned char { kTraverse, kFeed, kArc };
  Kind kind = Kind::kTraverse;
  Words from, to;
  Vec3 arc_centre = Vec3::Zero(),
       arc_axis = Vec3::UnitZ();  ///< kArc: as in make_arc, in the same frame as the words
  double arc_sweep_rad = 0;       ///< signed about arc_axis, any number of turns
  MapContext context;
  FeedLimit feed;
  double duration_s = 0;  ///< inverse time: the move takes this long, or longer; 0: the program does not say
  PathMode mode = PathMode::kContinuous;
  double tolerance_mm = 0;   ///< kContinuous: tip from the programmed path
  double tolerance_rad = 0;  ///< kContinuous: tool axis (or any rotary word) from the programmed one
  OutputChanges outputs;     ///< act where the move begins
  SourceLine source;
};

/// Receives the program in order. Both calls may throw what the receiver's own checks throw.
class MoveSink {
 public:
  virtual ~MoveSink() = default;
  virtual void move(const ProgramMove& move) = 0;
  virtual void event(const QueueEvent& event, SourceLine source) = 0;
};

/// A program that cannot be run; what() is "file:line:column: message".
struct ProgramError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace trn

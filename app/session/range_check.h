#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/program_rules.h"
#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/path.h"
#include "interp/move.h"

namespace trn {

/// A programmed move that the machine cannot make.
struct RefusedMove {
  std::uint32_t line = 0;
  char letter = 0;   ///< of the program word that is to blame; 0: no single one
  std::string text;  ///< what, and what would be right
};

/// Checks moves against the machine's rules for programs, and against the position limits of the joints,
/// through the joint map. With RTCP off a straight move takes a serial machine's joints straight: its end is
/// enough. Otherwise joints move on curves and may leave their range between two good ends, so places every 5
/// mm are checked, and those where a joint turns back near its limit.
class RangeCheck : public MoveSink {
 public:
  /// `assembly` must outlive it. `refuse` may throw; otherwise the moves go on, and a joint that is outside
  /// is reported again only when it has been inside in between.
  RangeCheck(const Assembly& assembly, std::function<void(const RefusedMove&)> refuse);

  /// Where the motor joints stand before the first move, mm or rad. One that is outside its range, as behind
  /// a homing switch at its end, may stay there and come in; it may not go farther out.
  void stand_at(const JointVec& q);

  void move(const ProgramMove& move) override;
  void event(const QueueEvent& event, SourceLine) override { rules_.hear(event); }

  std::uint64_t moves = 0;
  std::vector<Words> approach;  ///< ends of the moves before the program's first line

 private:
  bool judge(const ProgramMove& move, const Words& y, JointVec& q);
  void judge_turns(const ProgramMove& move, const PathPiece& piece, double s, double step);
  void come_in(const JointVec& q);
  std::string way_out(const ProgramMove& move, const Words& y) const;
  void judge_end(const ProgramMove& move);
  void outside(const ProgramMove& move, std::size_t joint, double value);
  char letter_of(std::size_t joint) const;

  const Assembly& assembly_;
  ProgramRules rules_;
  std::string refused_by_rule_;  ///< the move before, in words
  std::function<void(const RefusedMove&)> refuse_;
  bool straight_;   ///< with RTCP off words are joints
  bool separable_;  ///< with RTCP off each joint follows one word alone
  /// Then: a box of words in which every joint is inside its range, with this tool.
  Words lowest_, highest_;
  Vec3 box_tool_;
  bool has_box_ = false;
  bool stands_outside_ = false;              ///< a joint, since before the first move; there is no box then
  JointVec lowest_joint_, highest_joint_;    ///< their ranges, and where they stand outside, mm or rad
  std::array<JointVec, 3> near_;             ///< joints at the last three places of a move
  std::array<double, kMaxJoints> turned_{};  ///< where along the move each has last turned back
  unsigned outside_ = 0;                     ///< joints, as bits
  bool unreachable_ = false;
};

}  // namespace trn

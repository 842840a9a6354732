#pragma once

#include <optional>

#include "app/session/assembly.h"
#include "core/axes.h"
#include "core/motion.h"
#include "interp/move.h"

namespace trn {

/// A program run to look at: feed moves go as fast as the joints can, spindle and coolant stay off, and the
/// tool is drawn back by `up_mm` (along its axis with RTCP on, else along Z), or by as much as the joints'
/// ranges leave. Stands between the program and the planner.
class DryRun final : public MoveSink {
 public:
  /// `next` and `assembly` must outlive it.
  DryRun(MoveSink& next, const Assembly& assembly, double up_mm)
      : next_(next), assembly_(assembly), up_mm_(up_mm) {}

  void move(const ProgramMove& move) override;
  /// ProgramError "line N: ..." for a probe move: there is nothing to touch.
  void event(const QueueEvent& event, SourceLine source) override;

 private:
  Words drawn_back(const Words& y, const MapContext& context) const;
  bool fits(const Words& y, const MapContext& context) const;

  MoveSink& next_;
  const Assembly& assembly_;
  double up_mm_;
  JointVec stands_;                   ///< joints at the end of the last move; empty before the first
  std::optional<MapContext> before_;  ///< of the last move
  Words end_ = Words::Zero();         ///< of the last move
};

}  // namespace trn

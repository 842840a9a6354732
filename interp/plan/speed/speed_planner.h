#pragma once

#include <memory>

#include "core/axes.h"
#include "core/motion.h"
#include "core/ports.h"
#include "interp/plan/speed/speed_options.h"
#include "interp/plan/stages.h"

namespace trn {

namespace speed {
class WindowPlanner;
}

/// The speed stage: finds the time law of every stretch under the limits of the motor joints and the feed,
/// and emits blocks whose law is piecewise constant jerk of the path parameter, with s, ds/dt and d2s/dt2
/// continuous and both ends of a stretch at rest. Works in windows that depend on the program only; every
/// window's plan ends at rest, is verified on the law itself and replaces the verified one before. Throws
/// ProgramError ("line N: ...", without the file) when the map fails or a joint leaves its range; the
/// verified plan up to a standstill before that place has then been emitted, and what comes later is left
/// out.
class SpeedPlanner : public PieceSink {
 public:
  /// All references must outlive the planner.
  SpeedPlanner(const Joints& joints, const JointMap& map, const SpeedOptions& options, BlockSink& out);
  ~SpeedPlanner() override;

  void piece(const PlanPiece& piece) override;
  void event(const QueueEvent& event, SourceLine source) override;
  /// Ends the stretch that is open, if any, at the end of its last piece.
  void finish();

  /// It has thrown.
  bool failed() const;
  const SpeedStats& stats() const;

 private:
  std::unique_ptr<speed::WindowPlanner> windows_;
};

}  // namespace trn

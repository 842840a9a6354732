#include "interp/plan/speed/speed_planner.h"

#include "interp/plan/speed/window_planner.h"

namespace trn {

SpeedPlanner::SpeedPlanner(const Joints& joints, const JointMap& map, const SpeedOptions& options,
                           BlockSink& out)
    : windows_(std::make_unique<speed::WindowPlanner>(joints, map, options, out)) {}

SpeedPlanner::~SpeedPlanner() = default;

void SpeedPlanner::piece(const PlanPiece& piece) { windows_->piece(piece); }

void SpeedPlanner::event(const QueueEvent& event, SourceLine source) { windows_->event(event, source); }

void SpeedPlanner::finish() { windows_->finish(); }

bool SpeedPlanner::failed() const { return windows_->failed(); }

const SpeedStats& SpeedPlanner::stats() const { return windows_->stats(); }

}  // namespace trn

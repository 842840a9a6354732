#pragma once

#include <vector>

#include "app/library/trunnion.h"
#include "core/motion.h"
#include "interp/move.h"

namespace trn {

/// Keeps the moves of a program as the library gives them.
class MoveList : public MoveSink {
 public:
  void move(const ProgramMove& move) override;
  void event(const QueueEvent&, SourceLine) override {}
  std::vector<trunnion::Move> moves;
};

}  // namespace trn

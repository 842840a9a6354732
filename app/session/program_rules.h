#pragma once

#include <string>

#include "app/session/assembly.h"
#include "core/motion.h"
#include "interp/move.h"

namespace trn {

/// What a program may ask of this machine beside the ranges of its joints: a path tolerance, and threads that
/// every joint can follow. It sees the moves and events of a program in their order.
class ProgramRules {
 public:
  /// `assembly` must outlive it.
  explicit ProgramRules(const Assembly& assembly) : assembly_(assembly) {}

  /// "", or why the machine refuses this move, and what would be right; without its place.
  std::string refusal_of(const ProgramMove& move) const;
  void hear(const QueueEvent& event);

 private:
  std::string thread_refusal(const ProgramMove& move) const;

  const Assembly& assembly_;
  bool geared_ = false;  ///< moves follow the spindle's turns
};

}  // namespace trn

#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "app/session/assembly.h"
#include "app/session/machine_memory.h"
#include "interp/move.h"
#include "kernel/motion_queue.h"

namespace trn {

/// In memory that the daemon and its process for programs share, besides the queue.
struct SharedProgramState {
  std::atomic<bool> abandoned = false, closed = false;  ///< as in PlannerThread

  /// Moves of the program, for who measures its features: one writer, one reader.
  static constexpr std::uint32_t kMovesMax = 1024;
  std::array<ProgramMove, kMovesMax> moves;
  std::atomic<std::uint32_t> moves_put = 0, moves_taken = 0;
};

/// What a process for programs works with.
struct ProgramWorkerParts {
  const Assembly& assembly;  ///< of planning
  MotionQueue& queue;
  SharedProgramState& shared;
  MemoryFiles files;
  bool tells_moves = false;
  std::size_t memory_bytes = 0;
};

/// The life of such a process: hears ProgramCalls on `socket`, answers them, and ends when the other end has
/// gone. It begins with giving up all rights but to read files and to write those that it keeps.
void work_on_programs(const ProgramWorkerParts& parts, int socket);

}  // namespace trn

#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory_resource>

#include "app/daemon/shared_ring.h"
#include "app/session/assembly.h"
#include "app/session/machine_memory.h"
#include "app/session/program_step.h"
#include "interp/move.h"
#include "kernel/motion_queue.h"

namespace trn {

/// A step of the program with this number.
struct NumberedStep {
  std::uint32_t program = 0;
  ProgramStep step;
};

/// In memory that the daemon and its process for programs share, besides the queue.
struct SharedProgramState {
  static constexpr std::size_t kMovesMax = 1024, kStandsMax = 4;

  /// `memory`: for the rings. There is never more than one step for each block of the queue.
  SharedProgramState(std::size_t queue_blocks, std::pmr::memory_resource* memory)
      : moves(kMovesMax, memory), steps(queue_blocks + 2, memory), stands(kStandsMax, memory) {}
  static constexpr std::size_t bytes(std::size_t queue_blocks) {
    return SharedRing<ProgramMove>::bytes(kMovesMax) + SharedRing<NumberedStep>::bytes(queue_blocks + 2) +
           SharedRing<ProgramStep>::bytes(kStandsMax);
  }

  /// As in PlannerThread.
  std::atomic<bool> abandoned = false, closed = false, optional_stop = true;
  std::atomic<std::uint32_t> program = 0;  ///< counts programs
  SharedRing<ProgramMove> moves;           ///< for who measures the program's features
  SharedRing<NumberedStep> steps;          ///< of what is in the queue
  SharedRing<ProgramStep> stands;          ///< PlannerListeners::stands
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

#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "app/daemon/program_source.h"
#include "app/session/machine_outputs.h"
#include "app/session/pipeline.h"
#include "app/session/program_time.h"
#include "core/axes.h"
#include "hal/lcm_messages.h"
#include "interp/gcode/measured_values.h"

namespace trn {

/// What the daemon asks of the process that reads and plans its programs: one call of ProgramSource.
struct ProgramCall {
  enum class Kind : std::uint8_t {
    kLoad,
    kMdi,
    kConfirmTool,
    kSettle,
    kShow,
    kLoadPlace,
    kBlockDelete,
    kHeld,
    kCheckPlace,
    kDeleteTool,
    kCheckFiles,
    kStarts,
    kGaveUp
  };
  Kind kind = Kind::kLoad;
  std::string path, text;  ///< kLoad; kMdi, kHeld: the lines; kLoadPlace, kCheckPlace: the record
  std::uint32_t line = 0;  ///< kLoad: to begin at; 0: at the start; kBlockDelete: 1 on, 0 off
  JointVec q;              ///< kLoad, kMdi: where the machine stands, mm or rad
  ProgramSwitches switches;
  int tool = 0;          ///< kConfirmTool, kDeleteTool
  double before_mm = 0;  ///< kLoadPlace
  MachineOutputs outputs = {};
  std::uint64_t block = 0;  ///< kGaveUp
};

/// What comes back.
struct ProgramReply {
  enum class Kind : std::uint8_t {
    kStarts,    ///< the program is sound, its first block is about to be made: the daemon says when to go on
    kDone,      ///< the call is over
    kRefused,   ///< the same; `text` is why
    kFailed,    ///< without a call: the program cannot go on; `text` is why
    kSays,      ///< the same: the program says `text` to people, in `line`
    kTables,    ///< the same: offsets and tools are now `tables`
    kTime,      ///< the same: `program` takes `time`
    kMeasured,  ///< the same: `measured` was set; `line` 1: as a program that begins finds it
  };
  Kind kind = Kind::kDone;
  std::string text;
  std::uint32_t line = 0;   ///< kSays; kStarts: of the first line, if it is not the program's; kBlockDelete:
                            ///< of the ReadingPlace, whose file is `text`
  std::uint64_t block = 0;  ///< kStarts: ProgramStart::from_block; kBlockDelete: of the ReadingPlace
  trunnion::tables_t tables{};
  std::map<int, std::string> tools = {};  ///< kDone: names of the tools in the table, for people
  std::uint32_t program = 0;              ///< kTime: as SharedProgramState::program
  ProgramTime time = {};
  MeasuredValues measured = {};
  std::vector<double> stands =
      {};  ///< kDone of kHeld: HeldLines'; kStarts: ProgramStart::from_place, or none

  /// It ends a call.
  bool answers() const { return kind == Kind::kDone || kind == Kind::kRefused; }
};

std::string encode(const ProgramCall& call);
std::string encode(const ProgramReply& reply);
/// A reply of kTables.
std::string encode(const trunnion::tables_t& tables);
/// std::runtime_error for what `encode` does not make.
ProgramCall decode_call(const std::string& packet);
ProgramReply decode_reply(const std::string& packet);

/// The longest packet, bytes.
inline constexpr std::size_t kProgramPacketMax = std::size_t{1} << 17;
/// One packet to or from a local socket, whole; -1 with errno, 0: the other end has gone.
long send_program_packet(int fd, const std::string& packet);
long receive_program_packet(int fd, std::string& packet);

}  // namespace trn

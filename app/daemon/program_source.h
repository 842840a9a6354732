#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/session/machine_outputs.h"
#include "app/session/pipeline.h"
#include "app/session/place_record.h"
#include "app/session/program_step.h"
#include "app/session/program_time.h"
#include "core/axes.h"
#include "hal/lcm_messages.h"
#include "interp/gcode/measured_values.h"
#include "interp/gcode/program_config.h"

namespace trn {

/// What a program says to people: (MSG,), (DEBUG,), (PRINT,).
struct ProgramMessage {
  std::uint32_t line = 0;  ///< 0: it is about the program
  std::string text;
};

/// Where the reading of a program stands, ahead of its motion.
struct ReadingPlace {
  std::uint64_t block = 0;  ///< of its blocks, that were read
  std::uint32_t line = 0;   ///< that was read last; 0: nothing is read any more
  std::string file;         ///< it is a line of this
};

/// Prepares motion for the tick. Calls may take long; the daemon makes them in its worker thread.
class ProgramSource {
 public:
  virtual ~ProgramSource() = default;
  /// Prepares a program from its start, as far ahead as the ring goes, for a machine that stands at q (mm,
  /// rad). The tick has been told to forget the last one. Returns a remark for people, or "". ProgramError if
  /// the program cannot run.
  virtual std::string load(const std::string& path, const JointVec& q) = 0;
  /// The same from a line of it (> 1); returns the way to where it goes on there, in words.
  virtual std::string load_from(const std::string& path, const JointVec& q, std::uint32_t line) = 0;
  /// The same from the place of a record, or so many mm of the path before it.
  virtual std::string load_place(const PlaceRecord& place, const JointVec& q, double before_mm) = 0;
  /// While a program waits at a stop or for a tool: what `load_place` would find wrong, with before_mm 0.
  /// ProgramError; nothing changes.
  virtual void check_place(const PlaceRecord& place, const JointVec& q) = 0;
  /// Takes a tool out of the table; no program is under way. On disk when this returns. ProgramError: there
  /// is none, it is in the spindle, or the program at `path` ("": none) needs it.
  virtual void delete_tool(int number, const std::string& path, const JointVec& q) = 0;
  /// The operator has put the tool (0: none) into the spindle that the program waits for. On disk when this
  /// returns; FileError if that cannot be, and then it is not taken as changed.
  virtual void confirm_tool(int number) = 0;
  /// Any thread: a tool for people, with the remark that the table has of it.
  virtual std::string tool_name(int number) const = 0;
  virtual void load_mdi(const std::string& text, const JointVec& q) = 0;
  /// Of all programs loaded from now on.
  virtual void set_switches(const ProgramSwitches& switches) = 0;
  virtual ProgramSwitches switches() const = 0;
  /// Of all typed lines loaded from now on: what of M3, M4, M7 and M8 they find in force.
  virtual void set_outputs(const MachineOutputs& /*outputs*/) {}
  /// Block delete, also of the program that is under way: from the next line on that is read. ProgramError:
  /// the program cannot run so, and goes on as before.
  virtual ReadingPlace switch_block_delete(bool on) = 0;
  /// Lines of G10 and M61, as the operator gives them while the program waits at a stop or for a tool, and
  /// the machine stands at q: in force from there on, and on disk. ProgramError: then nothing has changed.
  virtual HeldLines obey_held(const std::string& text, const JointVec& q) = 0;
  /// Ends the preparation; from any thread, at once.
  virtual void abandon() = 0;
  /// The same, for good: what begins later ends at once too.
  virtual void close() { abandon(); }
  /// The message of an error that came later, once; "" if there was none.
  virtual std::string take_failure() = 0;
  /// After a failure, once: not even an end of the program follows; what there is of it must be given up.
  virtual bool lost() { return false; }
  /// What the program has said since, in order.
  virtual std::vector<ProgramMessage> take_messages() { return {}; }
  /// While no program is under way: finds out how the next one begins; `step(0)` then knows it, a little
  /// later. ProgramError.
  virtual void show() {}
  /// ProgramError if a file of the program that was loaded last is not the one any more that was read.
  virtual void check_files() {}
  /// The program that was loaded last is about to move. What its lines have set so far is kept from now on;
  /// of a program that is not started nothing is in force. FileError: it cannot be kept, and was not set.
  virtual void starts() {}
  /// The program that was under way was given up (`abandon`), and the machine stands in that block of it
  /// (ProgramStep::block; 0: before its first). What the lines behind that have set, for they are read ahead,
  /// is taken back (ChangeJournal::take_back_to). FileError: that cannot be kept.
  virtual void gave_up_at(std::uint64_t /*block*/) {}
  /// The step of the program that the tick reports; 0: between programs. Null: not known. Valid until the
  /// next call.
  virtual const ProgramStep* step(std::uint32_t /*number*/) { return nullptr; }
  /// Offsets and tools, once after each change; false if there is nothing new.
  virtual bool take_tables(trunnion::tables_t& /*tables*/) { return false; }
  /// What the operator has set since, in order: for PlaceRecord::measured. `begins`: as the program that was
  /// loaded last found it.
  struct Measured {
    MeasuredValues values;
    bool begins = false;
  };
  virtual std::vector<Measured> take_measured() { return {}; }
  /// How long the program that was loaded last takes, once it is known; false: no news.
  virtual bool take_program_time(ProgramTime& /*time*/) { return false; }
  /// Moves that were read since, to whoever measures features; before reports of what the tick did with them.
  virtual void hand_on_moves() {}
};

}  // namespace trn

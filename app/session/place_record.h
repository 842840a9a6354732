#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "app/session/program_step.h"
#include "core/axes.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/measured_values.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/tool_table.h"

namespace trn {

/// Where a program is, so that it can go on there after a power cut, a stop or a fault.
struct PlaceRecord {
  std::string program;        ///< whole path
  std::string mark;           ///< tells the content of that file from any other (file_mark)
  bool ended = false;         ///< it has come to its end: there is nothing to go on with
  std::uint64_t block = 0;    ///< as ProgramStep::block: which pass of the line
  std::uint32_t line = 0;     ///< that moved, of `file`
  std::string file, text;     ///< as in ProgramStep
  double gone_mm = 0;         ///< of the path, from where its motion began
  double left_mm = -1;        ///< to the end of its motion; below 0: not known
  bool moves = false;         ///< it has a motion, which ends at `to`
  MmWords to;                 ///< in the program's coordinates
  std::optional<MmWords> at;  ///< the same; none: not known
  int tool = 0;               ///< in the spindle
  std::string codes;          ///< in force, as in the status
  std::string work_offset;    ///< "G54 X1 Y2 Z3", for people
  double spindle_rpm = 0;     ///< + clockwise
  int coolant = 0;            ///< bits: 1 mist, 2 flood
  std::string work;           ///< the tip in the program's coordinates, for people
  bool block_delete = false;  ///< ProgramSwitches
  bool optional_stop = true;  ///< the same
  JointVec began;             ///< where the machine stood when the program was started, mm or rad
  /// How the block delete was switched while the program ran; the first: how it began. Empty: it was not.
  std::vector<BlockDeleteChange> block_delete_changes;
  MeasuredValues measured;  ///< ProgramStart::measured
};

/// The whole file (JSON), and back. ProgramError "name: what".
std::string place_file_text(const PlaceRecord& place);
PlaceRecord parse_place(std::string_view text, const std::string& name);
/// ProgramError where the program has come to its end, or has begun no line yet: there is nothing to go on
/// with.
void refuse_without_place(const PlaceRecord& place);
/// ProgramError also where there is none.
PlaceRecord read_place(const std::string& path);

/// Where a program goes on that was given up at a place.
struct PlaceEntry {
  std::uint64_t block = 0;  ///< ProgramStart::from_block
  std::uint32_t line = 0;   ///< of it
  double before_mm = 0;     ///< path from there to the place, at least
  double on_move_mm = 0;    ///< how far along the move of that block; 0: where it begins
  std::optional<EntryPlace> place = std::nullopt;  ///< ProgramStart::from_place
  std::string kept = "";  ///< what the operator has set and a line of the program would have set, for people
};

/// The place `before_mm` of the path before the other, where it lies on a straight feed or an arc. Else the
/// last block from whose beginning at least `before_mm` of the path lead to the place, outside cutter
/// compensation; the program's first if there is none. Runs the program up to the place, on copies.
/// ProgramError if the spindle holds another tool, the switches are not those of the record, or the program
/// no longer comes to that line.
PlaceEntry find_entry(const Assembly& assembly, Parameters parameters, ToolTable tools,
                      const ProgramStart& start, const PlaceRecord& place, double before_mm);

/// Where it was and where it goes on, in words for people.
std::string place_text(const PlaceRecord& place, const PlaceEntry& entry);

}  // namespace trn

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/config.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/cutter/tangential_knife.h"
#include "interp/gcode/g_code.h"
#include "interp/gcode/measured_values.h"
#include "interp/gcode/text/line_reader.h"

namespace trn {

/// What a word of another control's language means here.
enum class WordAction : std::uint8_t {
  kRtcpOn,
  kRtcpOff,
  kGreatCircle,
  kAxisPath,
  kKnifeOn,
  kKnifeOff,
  kSpindleIsAxis,
  kAxisIsSpindle,
  kIgnore
};

/// A word such as TRAORI, mapped by the config; M words ("M428") carry their number.
struct MappedWord {
  std::string text;  ///< lower case
  int m_code = -1;   ///< or -1
  WordAction action = WordAction::kIgnore;
  GCode g_code = kNoGCode;  ///< or none; kIgnore only
  /// The values that must stand with the G code, as P10000; none: any.
  std::vector<std::pair<char, double>> values = {};
  bool is_keyword() const { return m_code < 0 && g_code == kNoGCode; }
  bool alone = false;  ///< the G code has a meaning of its own: only these words, alone on a line
};

/// Whether a file must end with M2, M30 or a closing %.
enum class ProgramEnd : std::uint8_t {
  kExpected,  ///< a warning without it
  kRequired,  ///< an error
  kFree
};

/// An M code that switches corrections on or off until the program's end.
struct SwitchCode {
  int m_code = -1;
  bool on = false;
  std::int32_t corrections = 0;  ///< bits, as in QueueEvent::Kind::kCorrection
};

/// An M code of the user: calls a sub-program with P and Q, switches an output, or is handed on as an event.
struct UserCode {
  int code = 0;
  std::string call;  ///< or ""
  int output = -1;   ///< or -1
  bool on = true;
};

inline constexpr double kNoSpindleLimit = std::numeric_limits<double>::infinity();

/// [spindle_axis]: the spindle's drive is a joint of the machine.
struct SpindleAxisConfig {
  int axis = -1;                     ///< kA..kC: its word; -1: there is none
  double sense = -1;                 ///< 1: M3 turns its joint positively
  double word_sense = 1;             ///< joint = word_sense * word
  double rpm_max = kNoSpindleLimit;  ///< of its joint
};

/// What becomes of a gouge of a compensated contour.
enum class GougeCheckMode : std::uint8_t { kError, kWarning, kOff };

/// Who tells that the tool M6 asks for is in the spindle: [tool_change].
enum class ToolConfirm : std::uint8_t {
  kOperator,    ///< with 'resume'
  kInput,       ///< the rise of an input
  kSubProgram,  ///< the return of a sub-program, which is given the new tool and the old one
  kNobody       ///< M6 does not wait
};

/// The operator has switched the block delete while the program ran: behind so many of its blocks, as they
/// were read (Interpreter::blocks).
struct BlockDeleteChange {
  std::uint64_t after_block = 0;
  bool on = false;

  bool operator==(const BlockDeleteChange&) const = default;
};

/// The operator has set an offset, a tool's length or the tool in the spindle while the program waited,
/// behind so many of its blocks: lines of G10 and M61.
struct HeldLines {
  std::uint64_t after_block = 0;
  std::string text;
  std::array<double, 6> stands{};  ///< where the machine stood then: the program's words and units

  bool operator==(const HeldLines&) const = default;
};

/// [program]: what G code leaves open. All keys are optional.
struct ProgramConfig {
  MotionControl path_mode = MotionControl::kContinuous;  ///< at program start
  double parameter_unit_mm = 1;                          ///< of lengths in numbered parameters
  double tolerance_mm = 0.01;                            ///< of G64 without P
  double tolerance_deg = 0.05;                           ///< tool axis, of G64 without R
  double arc_tolerance_mm = 0.0283;    ///< start and end radius of an arc may differ by this, or
  double arc_tolerance_share = 0.001;  ///< by this share of the radius, up to 100 times as much
  GougeCheckMode gouge_check = GougeCheckMode::kError;
  double peck_clearance_mm = 0.254;  ///< G73 and G83 stop the rapid this far above the last depth
  double g183_retract_mm = 2.0;      ///< R of G183 when not given
  std::optional<double> safe_z_mm;   ///< machine Z to cross at when a program begins further down
  bool block_delete = false;         ///< lines that begin with '/' are skipped
  std::vector<BlockDeleteChange> block_delete_changes;  ///< in their order; not from [program]
  std::vector<HeldLines> held_lines;                    ///< the same
  MeasuredValues measured;                              ///< not from [program]
  bool typed = false;  ///< lines that the operator types in, which may add tools; not from [program]
  bool optional_stop = true;
  bool inch = false;          ///< G20 is in force at the start, and for typed lines
  double dry_run_up_mm = 20;  ///< how far the tool stays away from the work in a dry run
  ProgramEnd end = ProgramEnd::kExpected;
  ToolConfirm tool_confirm = ToolConfirm::kOperator;
  int tool_input = 0;                        ///< kInput: its number
  std::string tool_call;                     ///< kSubProgram: its name
  bool io = false;                           ///< the machine has a section [io]: inputs and a probe
  bool spindle_encoder = false;              ///< and [io.spindle] with an encoder
  double spindle_rpm_max = kNoSpindleLimit;  ///< and the speed that [io.spindle] allows
  double spindle_rpm_s = 0;                  ///< how fast its speed can change; 0: any speed at once
  unsigned wrapped_mask = 0;                 ///< bit kA..kC: absolute words are angles on a circle
  bool wrapped_by_sign = false;  ///< their sign is the way round, as LinuxCNC has it; else the short way
  bool great_circle = false;  ///< at program start: the tool axis goes the shortest way, not the rotary words
  std::vector<MappedWord> words = {{"orivect", -1, WordAction::kGreatCircle},
                                   {"oriaxes", -1, WordAction::kAxisPath},
                                   {"cycle832", -1, WordAction::kIgnore}};
  TangentialConfig tangential;
  SpindleAxisConfig spindle_axis;
  std::vector<UserCode> user_m;
  std::vector<SwitchCode> switches;           ///< from the sections of the corrections, not from [program]
  std::vector<std::string> sub_path = {"."};  ///< folders of sub-program files, beside the program's own
  OpenFile open = open_file;                  ///< program and sub-program files; not from [program]
  bool quote_lines =
      true;  ///< errors show the text of a line from their column on; else a G-code word at most
  std::size_t line_length_max = 65536;
  int sub_depth_max = 50;
};

/// The switch that `code` is; null if it is none.
const SwitchCode* find_switch(const ProgramConfig& config, int code);

/// Reads an M code "M421" that nothing else in `config` uses; ConfigError if there is no such.
int read_free_m(const ConfigTable& table, std::string_view key, const ProgramConfig& config);

/// Reads [program], [tool_change], [tangential] and [spindle_axis]; ConfigError with file, line and column.
ProgramConfig read_program_config(const ConfigTable& root);

}  // namespace trn

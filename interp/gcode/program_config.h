#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/config.h"
#include "interp/gcode/canon.h"

namespace trn {

/// What a word of another control's language means here.
enum class WordAction : std::uint8_t { kRtcpOn, kRtcpOff, kIgnore };

/// A word such as TRAORI, mapped by the config; M words ("M428") carry their number.
struct MappedWord {
  std::string text;  ///< lower case
  int m_code = -1;   ///< or -1
  WordAction action = WordAction::kIgnore;
};

/// [program]: what G code leaves open. All keys are optional.
struct ProgramConfig {
  MotionControl path_mode = MotionControl::kContinuous;  ///< at program start
  double tolerance_mm = 0.01;                            ///< of G64 without P
  double tolerance_deg = 0.05;                           ///< tool axis, of G64 without R
  double arc_tolerance_mm = 0.02;    ///< start and end radius of an arc may differ by this
  double peck_clearance_mm = 0.254;  ///< G73 and G83 stop the rapid this far above the last depth
  double g183_retract_mm = 2.0;      ///< R of G183 when not given
  bool block_delete = false;         ///< lines that begin with '/' are skipped
  bool optional_stop = true;
  bool require_program_end = true;  ///< a file must end with M2, M30 or %
  unsigned wrapped_mask = 0;        ///< bit kA..kC: absolute words take the short way round
  std::vector<MappedWord> words = {{"cycle832", -1, WordAction::kIgnore}};
  std::vector<int> user_m;                    ///< M codes handed on as user events
  std::vector<std::string> sub_path = {"."};  ///< folders of sub-program files, beside the program's own
  std::size_t line_length_max = 65536;
  int sub_depth_max = 50;
};

/// Reads [program]; ConfigError with file, line and column.
ProgramConfig read_program_config(const ConfigTable& root);

}  // namespace trn

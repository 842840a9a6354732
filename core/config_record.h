#pragma once

#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace trn {

class ConfigTable;

/// One question of a reader to a table of a config.
struct AskedKey {
  enum class Form : unsigned char {
    kPresence,  ///< only whether the key is there
    kNumber,
    kWholeNumber,
    kBoolean,
    kText,
    kChoice,
    kNumbers,
    kThreeNumbers,
    kTexts,
    kTable,
    kTables
  };

  std::string table;  ///< "drives.node[1]"; the root is ""
  std::string kind;   ///< the text `type` of the table, or of the nearest one around it that has any; or ""
  std::string key;
  Form form = Form::kPresence;
  bool required = false;
  std::string fallback;                                   ///< as a config would spell it; "" without one
  double min = -std::numeric_limits<double>::infinity();  ///< of kNumber and kWholeNumber, as of a Range
  double max = std::numeric_limits<double>::infinity();
  std::vector<std::string> choices;  ///< kChoice
};

/// Everything that the readers of one config asked it for, in that order. What stands under a key of a table
/// that is missing in the config is not asked for, so a config that shall show all keys must have all tables.
struct ConfigRecord {
  std::vector<AskedKey> asked;
};

/// As parse_config; the table, and those read from it, note in `record` what they are asked for.
ConfigTable parse_config(std::string_view text, const std::string& name,
                         std::shared_ptr<ConfigRecord> record);

}  // namespace trn

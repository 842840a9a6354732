#pragma once

#include <string>
#include <vector>

namespace trn {

/// A machine's config for `ask_all_readers`; `@name` in it is a blank to be filled in.
struct ConfigSpecimen {
  std::string name, text;
  std::string second_only;  ///< what only the second reading has
};

/// Together they have every table, and every key that a reader only looks for before it asks for its value.
/// A reader that learns a new table or such a key needs it here: a test finds it missing on the page.
std::vector<ConfigSpecimen> machine_specimens();

extern const char kFaultScriptSpecimen[];
extern const char kNetworksSpecimen[];
extern const char kSpindleAxisSpecimen[];
/// Parts of a machine's.
extern const char kSafetySpecimen[], kMotorSpecimen[], kTorqueSpecimen[];

}  // namespace trn

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <regex>
#include <string>

#include "app/session/assembly.h"
#include "core/axes.h"
#include "core/config.h"
#include "tests/fuzz/require.h"
#include "tests/support/paths.h"

// Fuzz target: any bytes as the config of a machine, put together with emulated drives and devices. What is
// accepted is a machine with limits that a plan can keep; an error names file, line and column.
namespace {

using namespace trn;
using fuzz::require;

// Data sheets and networks that a config names lie beside the configs.
const std::string& file() {
  static const std::string name = source_dir() + "/configs/fuzz.toml";
  return name;
}

// Of the config, or of a file that it names.
void require_place(const std::string& message) {
  static const std::regex place(":[0-9]+:[0-9]+: ");
  require(message.starts_with("/") && std::regex_search(message, place), "a place in: " + message);
}

void judge(const Joint& joint) {
  const JointLimit& limit = joint.limit;
  require(limit.min < limit.max, "a range");
  for (const double most : {limit.velocity, limit.acceleration, limit.jerk})
    require(std::isfinite(most) && most > 0, "limits that are numbers above 0");
}

void judge(const Assembly& assembly) {
  require(std::isfinite(assembly.machine.period_s) && assembly.machine.period_s > 0, "a period");
  require(!assembly.machine.joints.empty() && assembly.machine.joints.size() <= kMaxJoints, "joints");
  require(assembly.plan_joints.size() == assembly.machine.joints.size(), "as many joints for the plan");
  for (const Joint& joint : assembly.machine.joints) judge(joint);
  for (const Joint& joint : assembly.plan_joints) judge(joint);
  require(standing_joints(assembly).allFinite(), "joints that stand somewhere");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    judge(assemble(parse_config(fuzz::text_of(data, size), file())));
  } catch (const ConfigError& error) {
    require_place(error.what());
  }
  return 0;
}

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/operator_script.h"
#include "core/axes.h"
#include "kernel/rt_messages.h"
#include "tests/app/session/fuzz/program_generator.h"
#include "tests/app/session/fuzz/program_judge.h"
#include "tests/support/paths.h"
#include "tests/support/rounds.h"

// Random programs on every machine, held to the promises by judges that share no code with the planner. What
// they find is made smaller and printed with its seed.
//   TRN_LONG=20000: so many programs over all configs.   TRN_SEED=N: begins with this seed.
//   TRN_SHOW_PROGRAM=1: prints each program.
namespace trn {
namespace {

constexpr int kShortPrograms = 200;
constexpr int kShownMax = 3, kShrinkRuns = 150;
constexpr double kRefusedShareMax = 0.3;

int environment(const char* name, int otherwise) {
  const char* text = std::getenv(name);
  return text ? std::max(1, std::atoi(text)) : otherwise;
}

/// Now and then somebody turns the override, holds, or steps through the program.
fuzz::Driving seeded_driving(std::uint64_t seed) {
  using Kind = RtCommand::Kind;
  std::mt19937_64 rng(~seed);
  fuzz::Driving driving;
  const int kind = std::uniform_int_distribution<int>(0, 9)(rng);
  driving.single_block = kind == 0;
  if (kind > 1) return driving;
  double time_s = 0;
  for (int i = 0; i < 6; ++i) {
    time_s += std::uniform_real_distribution<double>(0.01, 0.8)(rng);
    if (i % 2 == 0)
      driving.script.push_back(
          {time_s, {Kind::kOverride, std::uniform_real_distribution<double>(0.1, 2)(rng)}});
    else
      driving.script.push_back({time_s, {Kind::kHold}});
    driving.script.push_back({time_s + 0.3, {Kind::kResume}});
    time_s += 0.3;
  }
  return driving;
}

/// As `--operator` reads it.
std::string script_text(const fuzz::Driving& driving) {
  using Kind = RtCommand::Kind;
  std::string text;
  for (const OperatorAction& action : driving.script) {
    text += fmt::format("{:.17g} ", action.time_s);
    if (action.command.kind == Kind::kOverride)
      text += fmt::format("override {:.17g}\n", 100 * action.command.value);
    if (action.command.kind == Kind::kHold) text += "hold\n";
    if (action.command.kind == Kind::kResume) text += "resume\n";
  }
  return text;
}

class ProgramFuzz : public testing::TestWithParam<std::string> {};

TEST_P(ProgramFuzz, EveryProgramKeepsThePromises) {
  const int configs = static_cast<int>(shipped_configs().size());
  const int count = (test::rounds(kShortPrograms) + configs - 1) / configs;
  const int first = environment("TRN_SEED", 1);
  const Assembly assembly = assemble(GetParam());
  const JointVec q_start = standing_joints(assembly);
  std::map<std::string, int> found;
  int refused = 0;
  for (int i = 0; i < count; ++i) {
    const auto seed = static_cast<std::uint64_t>(first + i);
    const fuzz::Program program = fuzz::ProgramGenerator(assembly, q_start, seed).make();
    const fuzz::Driving driving = seeded_driving(seed);
    if (std::getenv("TRN_SHOW_PROGRAM")) std::fprintf(stderr, "%s", program.text().c_str());
    const fuzz::Finding finding = fuzz::judge(GetParam(), program, driving);
    refused += finding.refused;
    if (std::getenv("TRN_SHOW_REFUSED") && finding.refused)
      std::fprintf(stderr, "%s\n", finding.detail.c_str());
    if (finding.kind.empty()) continue;
    if (found[finding.kind]++ >= kShownMax) continue;
    const fuzz::Program small = fuzz::shrink(GetParam(), program, driving, finding, kShrinkRuns);
    ADD_FAILURE() << "seed " << seed << ": " << finding.kind << ": " << finding.detail
                  << "\nsmaller: " << fuzz::judge(GetParam(), small, driving).detail
                  << (driving.single_block ? "\n--step" : "")
                  << (driving.script.empty() ? "" : "\n--operator:\n" + script_text(driving)) << "\n"
                  << small.text();
  }
  for (const auto& [kind, times] : found)
    EXPECT_EQ(times, 0) << kind << " in " << times << " of " << count << " programs";
  EXPECT_LE(refused, 1 + kRefusedShareMax * count);
  RecordProperty("programs", count);
  RecordProperty("refused", refused);
}

std::string config_name(const testing::TestParamInfo<std::string>& config) {
  return std::filesystem::path(config.param).stem().string();
}

// The programs and what is said of them begin at zero, where these two do not: one stands in the corner of
// its table behind homing. On the other the words A count round a circle, so that they do not say where it
// ends.
std::vector<std::string> fuzzed_configs() {
  std::vector<std::string> out;
  for (const std::string& path : shipped_configs())
    if (const std::string name = std::filesystem::path(path).stem().string();
        name != "gantry_router" && name != "fourth_axis")
      out.push_back(path);
  return out;
}

INSTANTIATE_TEST_SUITE_P(Programs, ProgramFuzz, testing::ValuesIn(fuzzed_configs()), config_name);

}  // namespace
}  // namespace trn

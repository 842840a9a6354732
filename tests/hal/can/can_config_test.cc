#include "hal/can/can_config.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "core/machine.h"
#include "hal/can/node_setup.h"
#include "hal/can/sdo.h"
#include "tests/support/eds_sheet.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

/// The cradle's config when `text` stands at the end of its first node.
CanDrivesConfig cradle_with(const std::string& text) {
  std::ifstream in(source_dir() + "/configs/cradle_can.toml");
  std::string config{std::istreambuf_iterator<char>(in), {}};
  if (text.substr(0, 6) == "eds = ") {  // in place of its own
    const std::size_t own = config.find("eds = ", config.find("[[drives.node]]"));
    config.erase(own, config.find('\n', own) + 1 - own);
  }
  config.insert(config.find("[[drives.node]]", config.find("[[drives.node]]") + 1), text);
  const ConfigTable root = parse_config(config, source_dir() + "/configs/cradle_can.toml");
  return read_can_drives(read_machine(root), root.table("drives"));
}

/// The message with which it is refused.
std::string refusal(const std::string& text) {
  try {
    cradle_with(text);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

/// The message for the cradle's config with `to` in place of the first `from`.
std::string refusal_of_edit(const std::string& from, const std::string& to) {
  std::ifstream in(source_dir() + "/configs/cradle_can.toml");
  std::string config{std::istreambuf_iterator<char>(in), {}};
  config.replace(config.find(from), from.size(), to);
  const ConfigTable root = parse_config(config, source_dir() + "/configs/cradle_can.toml");
  try {
    read_can_drives(read_machine(root), root.table("drives"));
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

std::string write_of(const std::string& index, const std::string& sub, const std::string& value) {
  return "[[drives.node.write]]\nindex = " + index + "\nsub = " + sub + "\nvalue = " + value + "\n";
}

TEST(CanConfig, ARampBeyondItsObjectIsTheSteepest) {
  for (const char* factor : {"1e9", "1e15"}) {
    const CanDrivesConfig config = cradle_with(std::string("quick_stop_factor = ") + factor + "\n");
    int found = 0;
    for (const SetupStep& step : config.buses.at(0).nodes.at(0).setup.steps) {
      if (step.key != ObjectKey{0x6085, 0}) continue;
      EXPECT_EQ(step.bytes, (std::vector<std::uint8_t>{0xFF, 0xFF, 0xFF, 0xFF})) << factor;
      ++found;
    }
    EXPECT_EQ(found, 1);
  }
}

TEST(CanConfig, HomeMayBeAnEndOfTheRange) {
  const std::string axis = "joint = \"A\"\nid = 4\n";
  for (const char* key : {"home_deg", "home_final_deg"})
    for (const char* end : {"-120", "120"}) {  // which come back from rad as 119.99999999999999
      EXPECT_EQ(refusal_of_edit(axis, fmt::format("{}{} = {}\n", axis, key, end)), "");
      EXPECT_NE(refusal_of_edit(axis, fmt::format("{}{} = {}.000001\n", axis, key, end)), "");
    }
}

// CiA 402-2, clause 11: 0 is no homing; 15, 16, 31, 32 and 36 are reserved; below 0 they are the maker's.
TEST(CanConfig, HomingMethodsAreThoseOfTheStandardAndTheMakers) {
  const auto told = [](const std::string& method) {
    return refusal_of_edit("homing_method = 5", "homing_method = " + method);
  };
  for (int method = -128; method <= 37; ++method) {
    const bool reserved = method == 15 || method == 16 || method == 31 || method == 32 || method == 36;
    const std::string text = told(std::to_string(method));
    if (method == 0)
      EXPECT_NE(text.find(":110:17: method 0 homes nothing"), std::string::npos) << text;
    else if (reserved)
      EXPECT_NE(text.find(":110:17: method " + std::to_string(method) + " is reserved"), std::string::npos)
          << text;
    else
      EXPECT_EQ(text, "") << method;
  }
  EXPECT_EQ(told("0\nabsolute = true"), "") << "an absolute encoder needs no method";
}

TEST(CanConfig, OfTwoBusesEveryDriveNamesItsOwn) {
  const std::string text =
      refusal_of_edit("bitrate = 1000000", "bitrate = 1000000\n[[drives.bus]]\ninterface = \"can1\"");
  EXPECT_NE(text.find("missing key 'drives.node[0].bus'"), std::string::npos) << text;
  EXPECT_NE(text.find("legal: can0, can1"), std::string::npos) << text;
}

TEST(CanConfig, BitratesAreTold) {
  const std::string text =
      refusal_of_edit("bitrate = 1000000", "bitrate = 1000000\nfd = true\ndata_bitrate = 500000");
  EXPECT_NE(text.find("must not be less than bitrate (1000000)"), std::string::npos) << text;
}

TEST(CanConfig, WritesAreOfObjectsThatThereAre) {
  EXPECT_EQ(refusal(""), "");
  EXPECT_EQ(refusal(write_of("0x6099", "1", "1000")), "");
  EXPECT_NE(refusal(write_of("0x6099", "256", "0")).find("255"), std::string::npos)
      << refusal(write_of("0x6099", "256", "0"));
  EXPECT_NE(refusal(write_of("0x6099", "255", "0")).find("object 0x6099:255 does not exist"),
            std::string::npos)
      << refusal(write_of("0x6099", "255", "0"));
  EXPECT_NE(refusal(write_of("0x6041", "0", "0")).find("object 0x6041:0 cannot be written"),
            std::string::npos)
      << refusal(write_of("0x6041", "0", "0"));
  EXPECT_NE(refusal(write_of("0x0FFF", "0", "0")), "");
}

TEST(CanConfig, WhatIsSkippedIsAnObject) {
  EXPECT_EQ(refusal("skip = [\"0x6085\", \"0x60c2:2\"]\n"), "");
  for (const char* bad : {"6085", "0x60C2:256", "0x60C2:", "0x123456", "quick stop", ""})
    EXPECT_NE(refusal(std::string("skip = [\"") + bad + "\"]\n").find("is no object"), std::string::npos)
        << bad;
  for (const char* strange : {"0x9999", "0x60C2:9"})
    EXPECT_NE(refusal(std::string("skip = [\"") + strange + "\"]\n").find(strange), std::string::npos)
        << "the sheet has none";
  EXPECT_NE(refusal("skip = [\"0x6040\"]\n").find("controlword"), std::string::npos);
}

TEST(CanConfig, TheInterpolationPeriodIsThatOfTheMachine) {
  EXPECT_EQ(refusal("interpolation_period = [20, -4]\n"), "") << "2 ms";
  for (const char* bad : {"[2, -4]", "[2]", "[0.5, -3]", "[2000, -6]"})
    EXPECT_NE(refusal(std::string("interpolation_period = ") + bad + "\n").find("must be machine.period_s"),
              std::string::npos)
        << bad;
  const CanDrivesConfig config = cradle_with("interpolation_period = [20, -4]\n");
  for (const SetupStep& step : config.buses.at(0).nodes.at(0).setup.steps) {
    if (step.key == ObjectKey{0x60C2, 1}) {
      EXPECT_EQ(step.bytes.at(0), 20);
    }
    if (step.key == ObjectKey{0x60C2, 2}) {
      EXPECT_EQ(static_cast<std::int8_t>(step.bytes.at(0)), -4);
    }
  }
}

// servo.eds: product 0x402, and a vendor of 0, which says nothing
TEST(CanConfig, IdentityIsTheDataSheetsUnlessTheConfigSaysOtherwise) {
  const auto checks = [](const std::string& text) {
    std::vector<std::uint64_t> out;
    const CanDrivesConfig config = cradle_with(text);
    for (const SetupStep& step : config.buses.at(0).nodes.at(0).setup.steps)
      if (step.key.index == 0x1018) out.insert(out.end(), {step.key.sub, get_le(step.bytes.data(), 4)});
    return out;
  };
  EXPECT_EQ(checks(""), (std::vector<std::uint64_t>{2, 0x402}));
  EXPECT_EQ(checks("vendor = 7\nproduct = 0\n"), (std::vector<std::uint64_t>{1, 7}));
}

/// The cradle with these objects more in its data sheet.
std::string sheet_refusal(const std::string& objects, const std::string& keys) {
  return refusal("eds = \"" + sheet_file(sheet_text({"605B", "605C", "605D"}, objects)) + "\"\n" + keys);
}

std::vector<SetupStep> steps_of(const CanDrivesConfig& config, ObjectKey key) {
  std::vector<SetupStep> out;
  for (const SetupStep& step : config.buses.at(0).nodes.at(0).setup.steps)
    if (step.key == key) out.push_back(step);
  return out;
}

TEST(CanConfig, OptionCodesAreWrittenWhenTheConfigHasThem) {
  const std::vector<ObjectKey> objects = {{0x605B, 0}, {0x605C, 0}, {0x605D, 0}};
  for (const ObjectKey key : objects) EXPECT_TRUE(steps_of(cradle_with(""), key).empty()) << to_string(key);
  const CanDrivesConfig config =
      cradle_with("at_shutdown = \"ramp\"\nat_disable = \"coast\"\nat_halt = \"quick_stop_ramp\"\n");
  const std::uint8_t values[] = {1, 0, 2};
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const auto steps = steps_of(config, objects[i]);
    ASSERT_EQ(steps.size(), 1u);
    EXPECT_EQ(steps[0].kind, SetupStep::Kind::kWrite);
    EXPECT_EQ(steps[0].bytes, (std::vector<std::uint8_t>{values[i], 0}));
  }
}

TEST(CanConfig, OptionCodesThatTheDriveCannotTakeAreRefused) {
  for (const auto& [key, word, object] :
       std::vector<std::array<std::string, 3>>{{"at_shutdown", "ramp", "605B"},
                                               {"at_disable", "ramp", "605C"},
                                               {"at_halt", "voltage_limit", "605D"}}) {
    const std::string keys = key + " = \"" + word + "\"\n";
    const auto says = [&](const std::string& message, const std::string& part) {
      EXPECT_NE(message.find(part), std::string::npos) << key << ": " << message;
    };
    says(sheet_refusal("", keys), "can0 node 1 (joint X) 0x" + object + ":0 does not exist");
    says(sheet_refusal(variable(object, "3", "ro", "0"), keys), "cannot be written");
    says(sheet_refusal(variable(object, "3", "rw", "0", "HighLimit=0\n"), keys), "does not take");
    says(sheet_refusal(variable(object, "9", "rw", ""), keys), "cannot be written");
    says(refusal(key + " = \"brake\"\n"), "legal");
    says(refusal(key + " = 1\n"), "string");
  }
}

// A node that sends no heartbeat is guarded: a question and an answer in each guarding time.
TEST(CanConfig, TheBudgetHasBothFramesOfGuarding) {
  const std::string sheet = "eds = \"" + sheet_file(sheet_text({"1016", "1017"})) + "\"\n";
  const CanBusConfig bus = cradle_with(sheet).buses.at(0);
  int found = 0;
  for (const BusBudget::Item& item : bus.budget.items) {
    if (item.what != "guarding") continue;
    ++found;
    EXPECT_EQ(item.frames, 2);
    EXPECT_EQ(item.bytes, 1);
    EXPECT_EQ(item.cycle_s, 0.05) << "guarding_ms is heartbeat_ms";
  }
  EXPECT_EQ(found, 1);
}

TEST(CanConfig, ATimeOfTheFollowingErrorIsOfTheDrivesOwn) {
  const std::string sheet =
      "eds = \"" +
      sheet_file(sheet_text({}, variable("6065", "7", "rw", "0") + variable("6066", "6", "rw", "0"))) +
      "\"\n";
  const ObjectKey key{0x6066, 0};
  // Set: written, then compared; not set: compared alone; both ways, and 0 is no leave to be late.
  const auto set = steps_of(cradle_with(sheet + "following_error_ms = 20\ndrive_limits = \"set\"\n"), key);
  ASSERT_EQ(set.size(), 3u);
  EXPECT_EQ(set[0].kind, SetupStep::Kind::kWish);
  EXPECT_EQ(set[0].bytes, (std::vector<std::uint8_t>{20, 0}));
  const auto checked = steps_of(cradle_with(sheet + "following_error_ms = 20\n"), key);
  ASSERT_EQ(checked.size(), 2u);
  EXPECT_EQ(checked[0].kind, SetupStep::Kind::kAtLeast);
  EXPECT_EQ(checked[1].kind, SetupStep::Kind::kAtMost);
  EXPECT_FALSE(checked[0].zero_passes);
  EXPECT_TRUE(steps_of(cradle_with(sheet), key).empty());
  EXPECT_NE(refusal("following_error_ms = 20\n").find("0x6066:0 does not exist"), std::string::npos);
  for (const char* bad : {"-1", "65536", "1.5", "\"20\"", "[20]"})
    EXPECT_NE(refusal(sheet + "following_error_ms = " + bad + "\n"), "") << bad;
  const auto narrow = [](const std::string& limits) {
    return sheet_refusal(variable("6065", "7", "rw", "0") + variable("6066", "5", "rw", "0", limits),
                         "following_error_ms = 400\ndrive_limits = \"set\"\n");
  };
  EXPECT_NE(narrow("").find("does not take 400"), std::string::npos) << narrow("");
  EXPECT_NE(narrow("").find("0x6066:0 has no limits"), std::string::npos) << narrow("");
  EXPECT_NE(narrow("HighLimit=200\n").find("0x6066:0 is any to 200"), std::string::npos)
      << narrow("HighLimit=200\n");
}

}  // namespace
}  // namespace trn

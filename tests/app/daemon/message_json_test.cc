#include "app/client/message_json.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include "hal/lcm_messages.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

// The names of the fields as a reader of the .lcm file finds them; those in [] of another field only count.
std::set<std::string> fields_of(const std::string& type) {
  std::ifstream in(source_dir() + "/hal/lcm/" + type + ".lcm");
  std::set<std::string> names, counts;
  const std::regex field(R"(^\s*\w+\s+(\w+)(?:\[(\w+)\])?\s*;)");
  for (std::string line; std::getline(in, line);) {
    std::smatch match;
    if (!std::regex_search(line, match, field) || line.find("package") != std::string::npos) continue;
    names.insert(match[1]);
    counts.insert(match[2]);
  }
  for (const std::string& count : counts) names.erase(count);
  return names;
}

TEST(MessageJson, EveryFieldOfTheStatusIsThere) {
  const nlohmann::json json = json_of(trunnion::status_t{});
  const std::set<std::string> fields = fields_of("status_t");
  ASSERT_GE(fields.size(), 50u);
  for (const std::string& name : fields) {
    const bool in_list =
        name.rfind("joint_", 0) == 0 || name.rfind("correction_", 0) == 0 || name.rfind("feature_", 0) == 0;
    EXPECT_EQ(json.contains(name), !in_list) << name;
  }
}

TEST(MessageJson, ListsAreBroughtTogetherAndBooleansAreBooleans) {
  trunnion::status_t status{};
  status.machine = "bench";
  status.single_block = 1;
  status.line = 7;
  status.joint_count = 2;
  status.joint_name = {"X", "A"};
  status.joint_unit = {"mm", "rad"};
  status.joint_homed = {1, 0};
  status.joint_limit_switch = {0, 1};
  status.warning_count = 1;
  status.warnings = {"no real-time rights"};
  const nlohmann::json json = json_of(status);
  EXPECT_EQ(json["machine"], "bench");
  EXPECT_EQ(json["line"], 7);
  EXPECT_TRUE(json["single_block"].is_boolean() && json["single_block"].get<bool>());
  EXPECT_EQ(json["joints"], nlohmann::json::parse(R"([
      {"name": "X", "unit": "mm", "homed": true, "limit_switch": false},
      {"name": "A", "unit": "rad", "homed": false, "limit_switch": true}])"));
  EXPECT_EQ(json["corrections"], nlohmann::json::array());
  EXPECT_EQ(json["warnings"], nlohmann::json::array({"no real-time rights"}));
}

TEST(MessageJson, ArraysWithoutAListStayArrays) {
  trunnion::motion_t motion{};
  motion.joint_count = 2;
  motion.q_setpoint = {1.5, -2};
  motion.q_measured = {1.25, -2};
  motion.word[5] = 0.5;
  const nlohmann::json json = json_of(motion);
  EXPECT_EQ(json["q_setpoint"], nlohmann::json::array({1.5, -2.0}));
  ASSERT_EQ(json["word"].size(), 6u);
  EXPECT_EQ(json["word"][5], 0.5);
  EXPECT_FALSE(json.contains("joint_count"));
}

}  // namespace
}  // namespace trn

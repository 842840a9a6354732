#include "core/config.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <regex>

#include "tests/kinematics/machines.h"

namespace trn {
namespace {

std::string read_text(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::string failure_of(const std::string& text) {
  try {
    make_kinematics(read_machine(parse_config(text, "m.toml")));
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

/// Every key and table name of [machine], [[joint]] and [kinematics] in turn, misspelt.
void misspell_every_key(const std::string& text) {
  const std::regex key_or_table(R"((^|\n)(\[+(kinematics\.)?|)([a-z][a-z0-9_]*)( =|\]+))");
  std::string section = "machine";
  int tried = 0;
  for (std::sregex_iterator it(text.begin(), text.end(), key_or_table), end; it != end; ++it) {
    const std::string word = it->str(4);
    const bool is_table = !it->str(2).empty();
    if (is_table) section = it->str(3).empty() ? word : "kinematics";
    if (section != "machine" && section != "joint" && section != "kinematics") continue;
    if (is_table && it->str(3).empty()) continue;  // the root's tables are the assembler's to judge
    std::string bad = text;
    bad.replace(static_cast<std::size_t>(it->position(4)), word.size(), word + "x");
    const std::string message = failure_of(bad);
    EXPECT_NE(message.find(fmt::format("did you mean '{}'?", word)), std::string::npos)
        << word << ": " << message;
    const auto line = 1 + std::count(text.begin(), text.begin() + it->position(4), '\n');
    EXPECT_EQ(message.rfind(fmt::format("m.toml:{}:", line), 0), 0u) << word << ": " << message;
    ++tried;
  }
  EXPECT_GT(tried, 20);
}

TEST(KinematicsConfig, EveryMisspeltKeyIsRefusedNamingTheNearest) {
  for (const char* name : {"cradle", "head", "head_table", "mill", "micro_stage", "hexapod", "rail_mill"}) {
    SCOPED_TRACE(name);
    misspell_every_key(read_text(config_path(name)));
  }
}

TEST(KinematicsConfig, ImpossibleGeometryIsRefused) {
  const std::string cradle = read_text(config_path("cradle"));
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = cradle;
    const auto at = text.find(from, text.find("[kinematics]"));
    EXPECT_NE(at, std::string::npos);
    return failure_of(text.replace(at, from.size(), to));
  };
  EXPECT_NE(with("joint = \"Y\"", "joint = \"X\"").find("already in a branch"), std::string::npos);
  EXPECT_NE(with("joint = \"Y\"", "joint = \"Q\"").find("is not legal"), std::string::npos);
  EXPECT_NE(with("joint = \"Y\"", "joint = \"Y\"\nword = \"X\"").find("both obey word X"), std::string::npos);
  EXPECT_NE(with("joint = \"Y\"", "joint = \"Y\"\nword = \"A\"").find("Legal: X, Y, Z"), std::string::npos);
  EXPECT_NE(with("joint = \"Y\"", "joint = \"Y\"\nsense = 0.5").find("sense is 1 or -1"), std::string::npos);
  EXPECT_NE(with("[0.0, 1.0, 0.0]", "[0.0, 0.0, 0.0]").find("must not be zero"), std::string::npos);
  EXPECT_NE(with("[0.0, 1.0, 0.0]", "[0.0, 1e200, 0.0]").find("too large to be meant"), std::string::npos);
  EXPECT_NE(with("\"serial\"", "\"cereal\"").find("did you mean \"serial\"?"), std::string::npos);
  EXPECT_NE(with("[[kinematics.work_branch]]\njoint = \"C\"\ndirection = [0.0, 0.0, 1.0]\noffset_mm", "#")
                .find("joint 'C' is in neither"),
            std::string::npos);
}

/// Refusals of the machine with one table of that name less, and with one more.
std::pair<std::string, std::string> one_less_one_more(const std::string& machine, const std::string& table) {
  const std::string text = read_text(config_path(machine));
  const auto first = text.find(table), second = text.find(table, first + 1);
  EXPECT_NE(second, std::string::npos);
  std::string less = text, more = text;
  less.erase(first, second - first);
  more.insert(first, text.substr(first, second - first));
  return {failure_of(less), failure_of(more)};
}

TEST(KinematicsConfig, LegsAndRailsAreCounted) {
  const auto [five, seven] = one_less_one_more("hexapod", "[[kinematics.leg]]");
  EXPECT_NE(five.find("a hexapod has 6 legs, not 5"), std::string::npos) << five;
  EXPECT_NE(seven.find("a hexapod has 6 legs, not 7"), std::string::npos) << seven;
  const auto [three, more] = one_less_one_more("rail_mill", "[[kinematics.rail]]");
  EXPECT_NE(three.find("a rail mill has 4 rails, not 3"), std::string::npos) << three;
  EXPECT_NE(more.find("a rail mill has 4 rails, not 5"), std::string::npos) << more;
}

TEST(KinematicsConfig, APlatformWithoutSizeIsRefused) {
  std::string text = read_text(config_path("rail_mill"));
  text = std::regex_replace(text, std::regex(R"(platform_mm = \[[^\]]*\])"), "platform_mm = [0.0, 0.0, 0.0]");
  const std::string message = failure_of(text);
  EXPECT_NE(message.find("every platform_mm is zero"), std::string::npos) << message;
}

}  // namespace
}  // namespace trn

#include "app/lab/commission/commission.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/lab/commission/commission_machine.h"
#include "app/lab/commission/emulated_commission.h"
#include "tests/support/paths.h"

// The order of a commissioning. Its whole rehearsal is tests/app/cli/commission_command.py.
namespace trn {
namespace {

namespace fs = std::filesystem;

/// Answers questions about figures; nothing else is asked here.
struct Person final : CommissionOperator {
  bool agrees(const std::string& text) override {
    asked.push_back(text);
    return answer;
  }
  double measured(const std::string& text, int) override { return unasked(text), 0; }
  bool went_positive(const std::string& text, int) override { return unasked(text); }
  bool turned_clockwise(const std::string& text) override { return unasked(text); }
  bool does(const std::string& text, HandStep, int) override { return unasked(text); }
  void lets_go(const std::string& text) override { unasked(text); }
  void tell(const std::string&) override {}
  static bool unasked(const std::string& text) {
    ADD_FAILURE() << text;
    return false;
  }
  bool answer = false;
  std::vector<std::string> asked;
};

class Commissioning : public testing::Test {
 protected:
  // X of cradle_can.toml at 30 m/s: a figure that somebody must stand by.
  Commissioning() {
    std::ifstream in(source_dir() + "/configs/cradle_can.toml");
    std::string text{std::istreambuf_iterator<char>(in), {}};
    const auto change = [&](const std::string& from, const std::string& to) {
      for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
        text.replace(at, from.size(), to);
    };
    change("eds/servo.eds", source_dir() + "/configs/eds/servo.eds");
    const std::string key = "velocity_mm_s = ";
    const std::size_t at = text.find(key) + key.size();
    text.replace(at, text.find_first_of(" \n", at) - at, "30000");
    std::ofstream(files_.config) << text;
  }
  ~Commissioning() override {
    fs::remove(files_.config);
    fs::remove(files_.record);
  }
  std::unique_ptr<Commission> commission() {
    const auto make = [this](bool feed_forward) {
      return std::make_unique<EmulatedCommission>(files_.config, files_.config, feed_forward);
    };
    return std::make_unique<Commission>(files_, make, machine_, person_);
  }
  void record_all_but(const std::vector<std::string>& open) {
    nlohmann::json items = nlohmann::json::array();
    const auto made = commission();
    for (const CommissionItem& item : made->items())
      if (std::find(open.begin(), open.end(), item.name) == open.end())
        items.push_back({{"name", item.name}, {"result", "good"}, {"note", "before"}});
    std::ofstream(files_.record) << nlohmann::json{{"machine", "cradle"}, {"items", items}};
  }
  static std::string result(const Commission& commission, const std::string& name) {
    for (const CommissionItem& item : commission.items())
      if (item.name == name) return item.result;
    return "no such item";
  }

  Commission::Files files_{testing::TempDir() + "/commission_test.toml",
                           testing::TempDir() + "/commission_test.json"};
  Person person_;
  std::unique_ptr<CommissionMachine> machine_;
};

TEST_F(Commissioning, BehindAnItemThatFailsNoOtherIsBegun) {
  record_all_but({"figures", "bus"});
  const auto refused = commission();
  EXPECT_FALSE(refused->run());
  ASSERT_EQ(person_.asked.size(), 1u);
  EXPECT_NE(person_.asked[0].find("30000 mm/s"), std::string::npos) << person_.asked[0];
  EXPECT_EQ(result(*refused, "figures"), "failed");
  EXPECT_EQ(result(*refused, "bus"), "");
  EXPECT_EQ(machine_, nullptr) << "no machine was made";
  // What failed is asked again, what was done before is not.
  person_.answer = true;
  const auto kept = commission();
  EXPECT_TRUE(kept->run());
  EXPECT_EQ(person_.asked.size(), 2u);
  EXPECT_EQ(result(*kept, "figures"), "good");
  EXPECT_NE(result(*kept, "bus"), "");
  EXPECT_EQ(result(*commission(), "latency"), "good");
}

}  // namespace
}  // namespace trn

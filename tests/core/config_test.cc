#include "core/config.h"

#include <gtest/gtest.h>

#include "core/machine.h"

namespace trn {
namespace {

std::string failure(const std::function<void()>& action) {
  try {
    action();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Config, ReadsWhatIsThere) {
  const ConfigTable root =
      parse_config("a = 1.5\nb = [1, 2, 3]\n[c]\nd = \"x\"\n[[e]]\nf = true\n", "t.toml");
  EXPECT_EQ(root.number("a"), 1.5);
  EXPECT_EQ(root.vec3("b"), Vec3(1, 2, 3));
  EXPECT_EQ(root.table("c").text("d"), "x");
  EXPECT_TRUE(root.tables("e").at(0).boolean("f"));
  EXPECT_NO_THROW(root.finish());
}

TEST(Config, ErrorsNamePlaceAndRemedy) {
  const std::string text = "[machine]\nname = \"m\"\nperiod_s = 5\n";
  EXPECT_EQ(failure([&] { read_machine(parse_config(text, "m.toml")); }),
            "m.toml:3:12: 'machine.period_s' = 5 is out of range: 1e-05 to 0.1 is legal");
  EXPECT_EQ(failure([&] { read_machine(parse_config("[machine]\nname=\"m\"\nperiods = 1", "m.toml")); }),
            "m.toml:3:1: unknown key 'machine.periods'; did you mean 'period_s'?");
  EXPECT_EQ(failure([&] { parse_config("a = ", "m.toml"); }).substr(0, 11), "m.toml:1:5:");
  const ConfigTable root = parse_config("[c]\nd = \"x\"\nspeed = 2\n", "t.toml");
  root.table("c").text("d");
  root.table("c").number("sped", 1, kPositive);
  EXPECT_EQ(failure([&] { root.finish(); }), "t.toml:3:1: unknown key 'c.speed'; did you mean 'sped'?");
  EXPECT_EQ(failure([&] {
              root.table("c").choice("d", {"y", "z"});
            }),
            "t.toml:2:5: 'c.d' = \"x\" is not legal; did you mean \"y\"? Legal: y, z");
}

}  // namespace
}  // namespace trn

#include "core/config.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "core/config_record.h"
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

TEST(Config, AKeyInAnotherUnitIsNamed) {
  const ConfigTable root = parse_config("[c]\nmax_inch = 4\n", "t.toml");
  EXPECT_EQ(failure([&] { root.table("c").number("max_mm"); }),
            "t.toml:2:1: unknown key 'c.max_inch'; did you mean 'max_mm'?");
  root.table("c").number("max_mm", 1, kPositive);
  EXPECT_EQ(failure([&] { root.finish(); }), "t.toml:2:1: unknown key 'c.max_inch'; did you mean 'max_mm'?");
}

TEST(Config, WhatTomlRefusesIsSaidInPlainWords) {
  EXPECT_EQ(failure([] { parse_config("a = 1\nb = 1,5\n", "t.toml"); }),
            "t.toml:2:6: '1,5' is no number; write 1.5, with a point");
  EXPECT_EQ(failure([] { parse_config("a = 1\nname = X\n", "t.toml"); }),
            "t.toml:2:8: a text stands in straight quotes: name = \"X\"");
  EXPECT_EQ(failure([] { parse_config("a = 1\nname = \"M\xFChle\"\n", "t.toml"); }),
            "t.toml:2:10: the byte 0xfc is no UTF-8; save the file as UTF-8");
  EXPECT_EQ(failure([] { parse_config("[a\nb = 1\n", "t.toml"); }).substr(0, 11), "t.toml:1:3:");
}

TEST(Config, AConfigIsARegularFileOfSomeSize) {
  EXPECT_EQ(failure([] { load_config(testing::TempDir()); }),
            testing::TempDir() + ":1:1: this is a folder; name a file in it");
  EXPECT_EQ(failure([] { load_config("/dev/zero"); }),
            "/dev/zero:1:1: this is no regular file but a device; name a file on a disk");
  EXPECT_EQ(failure([] { load_config(std::string("a.toml\0b", 8)); }),
            "a.toml:1:1: a file's name has no byte 0");
  const std::string path = testing::TempDir() + "config_test.toml";
  std::ofstream(path) << "a = 1\n";
  EXPECT_EQ(load_config(path).number("a"), 1);
  std::filesystem::resize_file(path, (std::uintmax_t{16} << 20) + 1);
  EXPECT_EQ(failure([&] { load_config(path); }),
            path + ":1:1: this file has more than 16 MB, the most that is legal; is it the right one?");
  std::filesystem::remove(path);
}

TEST(Config, ProposesAWordForSlipsOfTheFingersOnly) {
  // A letter left out, one too many, a wrong one, two in the wrong order.
  for (const char* written : {"velocty", "veloocity", "velozity", "veloctiy"})
    EXPECT_EQ(nearest_word(written, {"jerk", "velocity", "position"}), "velocity") << written;
  EXPECT_EQ(nearest_word("feet", {"reed", "feed"}), "feed") << "one letter is nearer than two";
  // Longer words with the same begin are other words: nine and eight letters are missing.
  EXPECT_EQ(nearest_word("rail", {"railing_width"}), "");
  EXPECT_EQ(nearest_word("home", {"homing_speed"}), "");
}

TEST(Config, NumbersAreFinite) {
  const ConfigTable root = parse_config("a = inf\nb = [0, 1, -inf]\n", "t.toml");
  EXPECT_EQ(failure([&] { root.number("a"); }), "t.toml:1:5: 'a' must be a finite number");
  EXPECT_EQ(failure([&] { root.number("a", 1, kPositive); }), "t.toml:1:5: 'a' must be a finite number");
  EXPECT_EQ(failure([&] { root.vec3("b"); }), "t.toml:2:12: 'b' must be a finite number");
  EXPECT_EQ(failure([&] { root.numbers("b"); }), "t.toml:2:12: 'b' must be a finite number");
}

TEST(Config, RangesAreToldInWords) {
  const ConfigTable root = parse_config("a = -1\nb = 9\nc = \"1 mm\"\nd = 7\n", "t.toml");
  EXPECT_EQ(failure([&] { root.number("a", kPositive); }),
            "t.toml:1:5: 'a' = -1 is out of range: above 0 is legal");
  EXPECT_EQ(failure([&] { root.number("a", kNotNegative); }),
            "t.toml:1:5: 'a' = -1 is out of range: 0 or more is legal");
  EXPECT_EQ(failure([&] {
              root.number("b", Range{kPositive.min, 5});
            }),
            "t.toml:2:5: 'b' = 9 is out of range: above 0, up to 5, is legal");
  EXPECT_EQ(failure([&] { root.number("c"); }),
            "t.toml:3:5: 'c' must be a number, without quotes and without a unit");
  EXPECT_EQ(failure([&] { root.text("d"); }), "t.toml:4:5: 'd' must be a string in quotes");
  EXPECT_EQ(failure([&] { root.numbers("d"); }), "t.toml:4:5: 'd' must be a list in square brackets");
}

TEST(Config, NumbersAreOfAMachine) {
  const ConfigTable root =
      parse_config("a = 1e300\nb = [0, -1.1e15]\nc = 1e-300\nd = 1e15\ne = 1e-12\n", "t.toml");
  EXPECT_EQ(failure([&] { root.number("a"); }),
            "t.toml:1:5: 'a' = 1e+300 is too large to be meant: up to 1e+15 is legal");
  EXPECT_NE(failure([&] { root.numbers("b"); }).find("t.toml:2:9: 'b' = -1.1e+15 is too large"),
            std::string::npos);
  EXPECT_EQ(failure([&] { root.number("c", kPositive); }),
            "t.toml:3:5: 'c' = 1e-300 is too small to be meant: 1e-12 or more is legal");
  EXPECT_EQ(root.number("c"), 1e-300);
  EXPECT_EQ(root.number("d", kPositive), 1e15);
  EXPECT_EQ(root.number("e", kPositive), 1e-12);
}

TEST(Config, TextsArePrintable) {
  const ConfigTable root = parse_config(
      "a = \"x\\u0000\"\nb = [\"\", \"l\\nf\"]\nc = \"" + std::string(1001, 'x') + "\"\nd = \"Fräse\"\n",
      "t.toml");
  EXPECT_EQ(failure([&] { root.text("a"); }),
            "t.toml:1:5: 'a' has a character that cannot be printed (0x00); leave it out");
  EXPECT_EQ(failure([&] { root.texts("b"); }),
            "t.toml:2:10: 'b' has a character that cannot be printed (0x0a); leave it out");
  EXPECT_EQ(failure([&] { root.text("c"); }), "t.toml:3:5: 'c' has 1001 bytes; up to 1000 are legal");
  EXPECT_EQ(root.text("d"), "Fräse");
}

// The unknown key is named, not a good one beside it.
TEST(Config, TheKeyThatIsMisspeltIsNamed) {
  const ConfigTable capitals = parse_config("MIN_MM = 1\nmax_mm = 2\n", "t.toml");
  EXPECT_EQ(failure([&] { capitals.number("min_mm"); }),
            "t.toml:1:1: unknown key 'MIN_MM'; did you mean 'min_mm'?");
  const ConfigTable beside = parse_config("cogging_at_mm = 1\ncogging_M = 2\n", "t.toml");
  beside.has("cogging_N");
  EXPECT_EQ(failure([&] { beside.finish(); }),
            "t.toml:2:1: unknown key 'cogging_M'; did you mean 'cogging_N'?");
  const ConfigTable bare = parse_config("min = 1\nmax_mm = 2\n", "t.toml");  // max_mm is legal with min_mm
  bare.has("min_mm");
  EXPECT_EQ(failure([&] { bare.finish(); }), "t.toml:1:1: unknown key 'min'; did you mean 'min_mm'?");
}

/// A question in words: "table kind key form required fallback min..max choices".
std::string words(const AskedKey& a) {
  std::string out = a.table + " <" + a.kind + "> " + a.key + " " + std::to_string(static_cast<int>(a.form)) +
                    (a.required ? " required" : "") + (a.fallback.empty() ? "" : " = " + a.fallback);
  if (a.max < 1e300) out += " " + std::to_string(a.min) + ".." + std::to_string(a.max);
  for (const std::string& choice : a.choices) out += " |" + choice;
  return out;
}

using Form = AskedKey::Form;
std::string form(Form form) { return std::to_string(static_cast<int>(form)); }

/// The questions but for those that a reader asks itself on the way to its answer.
std::vector<std::string> outer(const ConfigRecord& record) {
  std::vector<std::string> out;
  for (const AskedKey& asked : record.asked)
    if (out.empty() || out.back().find(" " + asked.key + " ") == std::string::npos)
      out.push_back(words(asked));
  return out;
}

TEST(ConfigRecord, NotesEveryFormOfQuestion) {
  const auto record = std::make_shared<ConfigRecord>();
  const ConfigTable root =
      parse_config("n = 2.5\ni = 3\nb = true\nt = \"x\"\nc = \"y\"\nv = [1, 2, 3]\nl = [1]\nw = [\"z\"]\n",
                   "t.toml", record);
  root.number("n", Range{1, 4});
  root.number("n2", 0.5, Range{-1, 4});
  root.integer("i", Range{0, 7});
  root.integer("i2", 16000000, kAnyNumber);
  root.boolean("b");
  root.boolean("b2", false);
  root.text("t");
  root.text("t2", "none");
  root.choice("c", {"y", "z"});
  root.choice("c2", {"y", "z"}, "z");
  root.vec3("v");
  root.vec3("v2", Vec3(0, -1.5, 0));
  root.numbers("l");
  root.texts("w");
  root.texts("w2", {"p", "q"});
  root.has("h");
  root.table_if("k");
  root.tables_if("ks");
  const std::vector<std::string> wanted = {
      " <> n " + form(Form::kNumber) + " required 1.000000..4.000000",
      " <> n2 " + form(Form::kNumber) + " = 0.5 -1.000000..4.000000",
      " <> i " + form(Form::kWholeNumber) + " required 0.000000..7.000000",
      " <> i2 " + form(Form::kWholeNumber) + " = 16000000",
      " <> b " + form(Form::kBoolean) + " required",
      " <> b2 " + form(Form::kBoolean) + " = false",
      " <> t " + form(Form::kText) + " required",
      " <> t2 " + form(Form::kText) + " = \"none\"",
      " <> c " + form(Form::kChoice) + " required |y |z",
      " <> c2 " + form(Form::kChoice) + " = \"z\" |y |z",
      " <> v " + form(Form::kThreeNumbers) + " required",
      " <> v2 " + form(Form::kThreeNumbers) + " = [0, -1.5, 0]",
      " <> l " + form(Form::kNumbers) + " required",
      " <> w " + form(Form::kTexts) + " required",
      " <> w2 " + form(Form::kTexts) + " = [\"p\", \"q\"]",
      " <> h " + form(Form::kPresence),
      " <> k " + form(Form::kTable),
      " <> ks " + form(Form::kTables)};
  EXPECT_EQ(outer(*record), wanted);
}

TEST(ConfigRecord, NamesTheTableAndTheNearestTypeAroundIt) {
  const auto record = std::make_shared<ConfigRecord>();
  const ConfigTable root = parse_config(
      "[d]\ntype = \"can\"\n[[d.node]]\nid = 1\n[[d.node]]\nid = 2\n[d.e]\ntype = \"own\"\nx = 1\n", "t.toml",
      record);
  const std::vector<ConfigTable> nodes = root.table("d").tables("node");
  nodes[1].integer("id");
  root.table("d").table("e").number("x");
  const std::string required = " required";
  EXPECT_EQ(outer(*record),
            (std::vector<std::string>{
                " <> d " + form(Form::kTable) + required, "d <can> node " + form(Form::kTables) + required,
                "d.node[1] <can> id " + form(Form::kWholeNumber) + required,
                " <> d " + form(Form::kTable) + required, "d <can> e " + form(Form::kTable) + required,
                "d.e <own> x " + form(Form::kNumber) + required}));
}

TEST(ConfigRecord, ChangesNoAnswerAndNoError) {
  const std::string text = "a = 5\nstranger = 1\n[s]\nb = \"x\"\n";
  const ConfigTable with = parse_config(text, "t.toml", std::make_shared<ConfigRecord>());
  const ConfigTable without = parse_config(text, "t.toml");
  for (const auto& read : std::vector<std::function<void(const ConfigTable&)>>{
           [](const ConfigTable& t) {
             t.number("a", Range{0, 1});
           },
           [](const ConfigTable& t) { t.table("s").choice("b", {"y"}); },
           [](const ConfigTable& t) { t.table("s").number("c"); }, [](const ConfigTable& t) { t.finish(); }})
    EXPECT_EQ(failure([&] { read(with); }), failure([&] { read(without); }));
  EXPECT_NE(failure([&] { with.finish(); }), "no error");
}

}  // namespace
}  // namespace trn

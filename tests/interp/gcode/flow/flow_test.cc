#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <string>
#include <utility>

#include "core/frames.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/error.h"
#include "interp/gcode/interpreter.h"
#include "tests/interp/gcode/run_program.h"

// O-words and sub-programs.
namespace trn {
namespace {

using test::canon;
using test::moves;
using test::Session;

// What a program without M2 is refused with.
std::string unended(const std::string& program) {
  Session session;
  test::CanonText sink;
  try {
    session.run(program, sink);
  } catch (const GcodeError& error) {
    return error.what();
  }
  return {};
}

TEST(Flow, Loops) {
  EXPECT_EQ(canon("o1 while [#1 lt 3]\n#1=[#1+1]\nG0 X#1\no1 endwhile"),
            moves({"T 1 0 0", "T 2 0 0", "T 3 0 0"}));
  EXPECT_EQ(canon("o1 do\n#1=[#1+1]\nG0 X#1\no1 while [#1 lt 2]"), moves({"T 1 0 0", "T 2 0 0"}));
  EXPECT_EQ(canon("o1 repeat [2]\n#1=[#1+1]\nG0 X#1\no1 endrepeat\nG0 Y1"),
            moves({"T 1 0 0", "T 2 0 0", "T 2 1 0"}));
  EXPECT_EQ(canon("o1 while [0]\nG0 X~broken, but skipped\no1 endwhile\nG0 Y1"), moves({"T 0 1 0"}));
}

TEST(Flow, BreakAndContinue) {
  const std::string body =
      "\n#1=[#1+1]\no2 if [#1 eq 2]\no1 continue\no2 endif\no3 if [#1 gt 3]\no1 break\no3 endif\nG0 X#1\n";
  const std::string expected = moves({"T 1 0 0", "T 3 0 0", "T 3 1 0"});
  EXPECT_EQ(canon("o1 while [1]" + body + "o1 endwhile\nG0 Y1"), expected);
  EXPECT_EQ(canon("o1 do" + body + "o1 while [1]\nG0 Y1"), expected);
  EXPECT_EQ(canon("o1 repeat [9]" + body + "o1 endrepeat\nG0 Y1"), expected);
}

TEST(Flow, Branches) {
  for (int i = 1; i <= 3; ++i)
    EXPECT_EQ(
        canon(fmt::format(
            "#1={}\no1 if [#1 eq 1]\nG0 X1\no1 elseif [#1 eq 2]\nG0 X2\no1 else\nG0 X3\no1 endif\nG0 Y1", i)),
        moves({fmt::format("T {} 0 0", i), fmt::format("T {} 1 0", i)}));
}

// In a loop the way out of a branch and the way to the next one are both remembered, and not mixed up.
TEST(Flow, BranchesInsideALoop) {
  EXPECT_EQ(canon("o1 repeat [3]\n#1=[#1+1]\no2 if [#1 eq 3]\nG0 X3\no2 elseif [#1 eq 2]\nG0 X2\no2 else\n"
                  "G0 X1\no2 endif\nG0 Y#1\no1 endrepeat"),
            moves({"T 1 0 0", "T 1 1 0", "T 2 1 0", "T 2 2 0", "T 3 2 0", "T 3 3 0"}));
}

TEST(Flow, WhatIsOpenAtTheEndIsNamed) {
  EXPECT_EQ(Session().error("o1 while [1]\nG0 X1\nM2"),
            "p.ngc:3:1: no end of the loop for o1 of line 1: 'M2'; legal: close it in the same file");
  EXPECT_EQ(Session().error("o7 if [1]\nM2"),
            "p.ngc:2:1: no endif for o7 of line 1: 'M2'; legal: close it in the same file");
  for (const char* open : {"o100 if [1]", "o100 while [1]", "o100 repeat [2]", "o100 do"}) {
    const std::string error = Session().error("G21\nG0 X1\n" + std::string(open) + "\nG0 X2\nG0 X3\nM2");
    EXPECT_NE(error.find("for o100 of line 3: 'M2'"), std::string::npos) << error;
    const bool branch = std::string_view(open) == "o100 if [1]";
    const std::string told = fmt::format("no {} for o100 of line 3", branch ? "endif" : "end of the loop");
    const std::string text = "G21\nG0 X1\n" + std::string(open) + "\nG0 X2\n";
    EXPECT_NE(unended(text).find(told), std::string::npos) << open;
    EXPECT_NE(unended("%\n" + text + "%\n").find("for o100 of line 4"), std::string::npos) << open;
  }
  EXPECT_EQ(Session().error("o7 if [1]\nM2\no7 endif\nG0 X1"), "");
}

// The line of the sub-program that does not end, and the word that ends it; not that of the call.
TEST(Flow, AnOpenSubProgramIsNamed) {
  EXPECT_EQ(unended("M98 P100\nM30\nO100\nG0 X1\n").substr(0, 36), "p.ngc:5:1: no M99 for O100 of line 3");
  EXPECT_EQ(unended("o100 call\nM2\no100 sub\nG0 X1\n").substr(0, 39),
            "p.ngc:5:1: no endsub for o100 of line 3");
}

// The end of what is passed over is found by the value of its label; that of a sub is looked for too early.
TEST(Flow, ComputedLabels) {
  EXPECT_EQ(canon("#1=100\no[#1+1] if [0]\nG0 X1\no[#1+1] endif\nG0 Y1"), moves({"T 0 1 0"}));
  EXPECT_EQ(canon("#1=3\no#1 while [0]\nG0 X1\no3 endwhile\nG0 Y1"), moves({"T 0 1 0"}));
  EXPECT_EQ(Session().error("#1=7\no#1 if [1]\nG0 X1\nM2\no#1 endif"), "");
  // The label changes with each pass, and with it the end that is meant.
  EXPECT_EQ(canon("o1 repeat [2]\n#1=[#1+1]\no[#1+10] if [0]\nG0 X9\no12 endif\nG0 X5\no1 continue\n"
                  "o11 endif\nG0 X1\no1 endrepeat"),
            moves({"T 1 0 0", "T 5 0 0"}));
  EXPECT_EQ(
      Session().error("o[100+1] sub\no[100+1] endsub\nM2"),
      "p.ngc:1:1: bad O-word: the label of a sub is computed: o and an integer or <name>; only the call "
      "may compute it: 'o[100+1]'");
}

// A program begun further down: modes, tool and place as the lines before leave them, and the way there.
TEST(Flow, BeginsAtALine) {
  Session s;
  test::CanonText sink;
  const std::string program =
      "G21 G91 F100\nT2 M6\no1 repeat [2]\n#1=[#1+1]\nG1 X5 Z-1\no1 endrepeat\nG10 L2 P1 Y2\nG1 X#1\nM2\n";
  Interpreter interpreter({s.config, s.parameters, s.tools, nullptr, sink, {}});
  const MachineWords stands{{1, 1, 3}, Vec3::Zero()};
  interpreter.open_text(program, "p.ngc", stands);
  sink.text.clear();
  interpreter.begin_at(8, stands);
  while (interpreter.step()) {
  }
  const std::string expected = moves({"T 1 -1 3", "T 11 -1 3", "T 11 -1 1", "F 13 -1 1"});
  std::string straight;
  for (std::size_t at = 0, end = 0; (end = sink.text.find('\n', at)) != std::string::npos; at = end + 1)
    if (sink.text.compare(at, 8, "STRAIGHT") == 0) straight += sink.text.substr(at, end - at + 1);
  EXPECT_EQ(straight, expected) << sink.text;
  EXPECT_NE(sink.text.find("CHANGE_TOOL(2)"), std::string::npos);
  EXPECT_NE(sink.text.find("SET_FEED_RATE(100.0000)"), std::string::npos);
}

TEST(Flow, CallsByNumberNameAndExpression) {
  EXPECT_EQ(canon("o100 sub\nG0 X#1 Y#2\no100 endsub [#1 * 10]\no100 call [1] [2]\nG0 Z#<_value>"),
            moves({"T 1 2 0", "T 1 2 10"}));
  EXPECT_EQ(canon("o<drill> sub\nG0 X#1\no<drill> return [7]\nG0 X99\no<drill> endsub\nO<Drill> CALL [4]\nG0 "
                  "Z#<_value>"),
            moves({"T 4 0 0", "T 4 0 7"}));
  EXPECT_EQ(canon("o7 sub\nG0 X1\no7 endsub\n#3=7\no#3 call\no[3+4] call"), moves({"T 1 0 0", "T 1 0 0"}));
}

TEST(Flow, ALabelFromAnExpressionIsAWholeNumberFromZero) {
  EXPECT_EQ(canon("o0 sub\nG0 X1\no0 endsub\no[0] call\no[1 - 0.99995] call"), moves({"T 1 0 0", "T 1 0 0"}));
  for (const char* bad : {"-1", "0.5", "1.001"})
    EXPECT_NE(Session().error(fmt::format("o[{}] call\nM2", bad)).find("the label"), std::string::npos)
        << bad;
}

TEST(Flow, CallBeforeDefinitionAndRecursion) {
  EXPECT_EQ(canon("o1 call [3]\no1 sub\no2 if [#1 gt 0]\nG0 X#1\no1 call [#1 - 1]\no2 endif\no1 endsub"),
            moves({"T 3 0 0", "T 2 0 0", "T 1 0 0"}));
}

TEST(Flow, IndexingManyLabelsKeepsTheOneThatIsLookedFor) {
  std::string definitions;
  for (int i = 100; i < 400; ++i) definitions += fmt::format("o{} sub\no{} endsub\n", i, i);
  EXPECT_NE(Session().error("o1 call\n" + definitions).find("there is no sub-program o1:"),
            std::string::npos);
}

TEST(Flow, NumberedSubPrograms) {
  Session session;
  test::CanonText sink;
  session.run("G91\nM98 P7 L3\nM2\nO7\nG0 X1\nM99\n", sink);
  EXPECT_NE(sink.text.find("STRAIGHT_TRAVERSE(3.0000"), std::string::npos);
  EXPECT_EQ(sink.text.find("STRAIGHT_TRAVERSE(4.0000"), std::string::npos);
}

/// A folder of sub-program files, gone with the object.
class SubFolder {
 public:
  SubFolder(std::initializer_list<std::pair<std::string, std::string>> files) {
    std::filesystem::create_directory(path_);
    for (const auto& [name, text] : files) std::ofstream(path_ / name) << text;
    session.config.sub_path = {path_.string()};
  }
  SubFolder(const SubFolder&) = delete;
  SubFolder& operator=(const SubFolder&) = delete;
  ~SubFolder() { std::filesystem::remove_all(path_); }
  Session session;

 private:
  const std::filesystem::path path_ = std::filesystem::path(testing::TempDir()) / "subs";
};

TEST(Flow, SubProgramFiles) {
  SubFolder folder{{"probe_it.ngc", "o<probe_it> sub\nG0 X#1\no<probe_it> endsub [5]\nM2\n"}};
  EXPECT_EQ(folder.session.canon("o<probe_it> call [2]\nG0 Y#<_value>"), moves({"T 2 0 0", "T 2 5 0"}));
}

// A file that was called stays open: what else it defines is known from then on.
TEST(Flow, AFileThatIsOpenLendsItsOtherSubPrograms) {
  SubFolder folder{{"a.ngc", "o<a> sub\nG0 X1\no<a> endsub\no<b> sub\nG0 Y#1\no<b> endsub\nM2\n"}};
  EXPECT_EQ(folder.session.canon("o<a> call\no<b> call [3]"), moves({"T 1 0 0", "T 1 3 0"}));
}

// A file of M98 may end without M99. One of an O-word must end with endsub, and so must what stands in the
// main program.
TEST(Flow, OnlyANumberedFileMayEndWithoutItsEnd) {
  SubFolder folder{{"7.ngc", "O7\nG0 X1\n"}, {"a.ngc", "o<a> sub\nG0 X1\n"}};
  EXPECT_EQ(folder.session.canon("M98 P7\nG0 Y1"), moves({"T 1 0 0", "T 1 1 0"}));
  EXPECT_NE(folder.session.error("o<a> call").find("no endsub for oa of line 1"), std::string::npos);
  test::CanonText sink;
  EXPECT_THROW(folder.session.run("M98 P8\nM2\nO8\nG0 X1\n", sink), GcodeError);
}

TEST(Flow, AnEndlessLoopOfOWordsLetsTheCallerGo) {
  Session session;
  test::CanonText sink;
  Interpreter interpreter({session.config, session.parameters, session.tools, nullptr, sink, {}});
  interpreter.open_text("o1 while [1]\no1 endwhile\nM2\n", "p.ngc");
  const std::string start = sink.text;
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(interpreter.step());
  EXPECT_EQ(sink.text, start);
}

TEST(Flow, LongLoopsKeepBoundedMemory) {
  // more blocks inside one loop than the store keeps: emptied and filled again, same result
  std::string program = "o1 repeat [2]\n";
  for (std::size_t i = 0; i < Flow::kMaxKept + 10; ++i) program += "#2=[#2+1]\n";
  Session session;
  session.canon(program + "o1 endrepeat");
  EXPECT_EQ(session.parameters[2], 2.0 * (Flow::kMaxKept + 10));
}

}  // namespace
}  // namespace trn

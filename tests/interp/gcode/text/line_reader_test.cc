#include "interp/gcode/text/line_reader.h"

#include <gtest/gtest.h>

#include "interp/gcode/error.h"

namespace trn {
namespace {

LineReader reader_of(std::string text, std::size_t most = 100) {
  return {text_source(std::move(text)), most};
}

std::vector<std::string> lines_of(const std::string& text) {
  LineReader reader = reader_of(text);
  std::vector<std::string> lines;
  for (std::string_view line; reader.next(line);) lines.emplace_back(line);
  return lines;
}

TEST(LineReader, EndsOfLinesAndTheByteOrderMarkAreTakenOff) {
  EXPECT_EQ(lines_of("a\nb\n"), (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(lines_of("a\r\n\r\nb"), (std::vector<std::string>{"a", "", "b"}));
  EXPECT_EQ(lines_of("\xEF\xBB\xBFG1\n"), (std::vector<std::string>{"G1"}));
}

TEST(LineReader, GoesBackToAPlace) {
  LineReader reader = reader_of("one\ntwo\nthree\n");
  std::string_view line;
  ASSERT_TRUE(reader.next(line));
  const LinePlace second = reader.place();
  EXPECT_EQ(second.line, 2U);
  while (reader.next(line)) {
  }
  ASSERT_TRUE(reader.seek(second));
  ASSERT_TRUE(reader.next(line));
  EXPECT_EQ(line, "two");
  EXPECT_EQ(reader.place().line, 3U);
}

TEST(LineReader, AnOverlongLineIsRefusedAndTheNextIsRead) {
  LineReader reader = reader_of(std::string(500, 'x') + "\nG1\n");
  std::string_view line;
  EXPECT_THROW(reader.next(line), BlockError);
  ASSERT_TRUE(reader.next(line));
  EXPECT_EQ(line, "G1");
}

TEST(LineReader, AFileThatIsNotThereIsNullOnlyWhereItMayBeMissing) {
  EXPECT_EQ(open_file("/no/such/file.ngc", true), nullptr);
  EXPECT_THROW(open_file("/no/such/file.ngc"), BlockError);
}

}  // namespace
}  // namespace trn

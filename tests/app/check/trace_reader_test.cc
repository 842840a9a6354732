#include "app/check/trace_reader.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace trn {
namespace {

class Reader : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }
  TraceReader reader(const std::string& text) {
    std::ofstream(path_, std::ios::binary) << text;
    return {path_, {"A", "X"}};
  }
  std::string failure(const std::string& text) {
    try {
      TraceReader trace = reader(text);
      TraceRow row;
      while (trace.next(row)) continue;
    } catch (const TraceError& error) {
      return std::string(error.what()).substr(path_.size());
    }
    return "";
  }
  std::string path_ = ::testing::TempDir() + "/reader.csv";
};

TEST_F(Reader, FindsColumnsByNameAndCountsDigits) {
  TraceReader trace = reader("t_s,X,other,A,line\n0.5,1.250,9,-1.2e-4,7\n0.501,1e2,9,0,8\n");
  TraceRow row;
  ASSERT_TRUE(trace.next(row));
  EXPECT_EQ(row.t_s, 0.5);
  EXPECT_EQ(row.q, (std::vector<double>{-1.2e-4, 1.25})) << "in the order asked for";
  EXPECT_EQ(row.digits[0].decimals, 5);
  EXPECT_EQ(row.digits[0].significant, 2);
  EXPECT_EQ(row.digits[1].decimals, 3);
  EXPECT_EQ(row.digits[1].significant, 4);
  EXPECT_EQ(row.line, 7u);
  ASSERT_TRUE(trace.next(row));
  EXPECT_EQ(row.digits[1].decimals, -2);
  EXPECT_FALSE(trace.next(row));
}

TEST_F(Reader, SaysWhereTheTraceIsDamaged) {
  EXPECT_NE(failure("").find(":1:"), std::string::npos);
  EXPECT_NE(failure("t_s,X\n0,1\n").find("A"), std::string::npos) << "a joint without a column";
  EXPECT_EQ(failure("t_s,X,A\n0,1,2\n0.001,1,x\n").substr(0, 5), ":3:9:");
  EXPECT_EQ(failure("t_s,X,A\n0,1,2\n0.001,1\n").substr(0, 3), ":3:");
  EXPECT_NE(failure("t_s,X,A\n0,nan,2\n"), "");
  EXPECT_NE(failure("t_s,X,A\n0,inf,2\n"), "");
}

// A damaged field may be a megabyte: its first 24 bytes are shown.
TEST_F(Reader, QuotesTheBeginOfALongField) {
  const std::string letters(24, 'x');
  EXPECT_EQ(failure("t_s,X,A\n0,1," + letters + "\n"), ":2:5: '" + letters + "' is not a finite number");
  EXPECT_EQ(failure("t_s,X,A\n0,1," + letters + "y\n"), ":2:5: '" + letters + "...' is not a finite number");
}

TEST_F(Reader, SaysWhereItsHeaderIsWrong) {
  EXPECT_EQ(failure("t_s,X,A,X\n").substr(0, 6), ":1:9: ");
  EXPECT_EQ(failure("X,t_s,A\n").substr(0, 6), ":1:1: ");
}

}  // namespace
}  // namespace trn

#include "app/gateway/counter_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>

#include "core/safe_file.h"

namespace trn {
namespace {

class Counters : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = ::testing::TempDir() + "counters-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string path() const { return folder_ + "/counters"; }
  std::string text() const {
    std::ifstream file(path());
    return {std::istreambuf_iterator<char>(file), {}};
  }
  std::string folder_;
};

TEST_F(Counters, AreThereAgain) {
  {
    CounterFile file(path(), "mill");
    EXPECT_TRUE(file.is_new());
    EXPECT_EQ(file.last("anna"), 0);
    file.raise("anna", 7);
    file.raise("bert@desk", std::numeric_limits<std::int64_t>::max());
    file.raise("anna", 5);
    EXPECT_EQ(file.last("anna"), 7) << "only rises";
    file.save();
    file.raise("anna", 9);  // never saved
  }
  CounterFile file(path(), "mill");
  EXPECT_FALSE(file.is_new());
  EXPECT_EQ(file.last("anna"), 7);
  EXPECT_EQ(file.last("bert@desk"), std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(file.last("carl"), 0);
  file.raise("carl", 1);
  file.save();
  EXPECT_NE(text().find("anna 7\n"), std::string::npos) << "also of keys that nobody asked for";
}

// Whatever is not the whole file would let something in again.
TEST_F(Counters, DamagedAreRefused) {
  {
    CounterFile file(path(), "mill");
    file.raise("anna", 7000);
    file.raise("bert", 8000);
    file.save();
  }
  const std::string whole = text();
  EXPECT_THROW(CounterFile(path(), "lathe"), std::runtime_error);
  for (std::size_t size = 0; size < whole.size() - 1; ++size) {
    std::ofstream(path()) << whole.substr(0, size);
    EXPECT_THROW(CounterFile(path(), "mill"), std::runtime_error) << size;
  }
  for (const char* more : {"x", "\n", "anna 1\n"}) {
    std::ofstream(path()) << whole << more;
    EXPECT_THROW(CounterFile(path(), "mill"), std::runtime_error) << more;
  }
  for (const char* line : {"anna", "anna -5", "anna x", "anna 5 5", "anna 99999999999999999999"}) {
    std::ofstream(path()) << "counters of machine mill\n" << line << "\nend\n";
    EXPECT_THROW(CounterFile(path(), "mill"), std::runtime_error) << line;
  }
  std::ofstream(path()) << whole;
  EXPECT_EQ(CounterFile(path(), "mill").last("anna"), 7000);
}

TEST_F(Counters, APipeInTheirPlaceIsNotWaitedFor) {
  ASSERT_EQ(mkfifo(path().c_str(), 0600), 0);
  try {
    const CounterFile file(path(), "mill");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()).find(path() + ": this is no regular file but a pipe"), 0u)
        << error.what();
  }
}

TEST_F(Counters, BelongToOneGatewayAtATime) {
  {
    const CounterFile first(path(), "mill");
    EXPECT_THROW(CounterFile(path(), "mill"), std::runtime_error);
  }
  EXPECT_NO_THROW(CounterFile(path(), "mill"));
}

TEST_F(Counters, ThatCannotBeKeptAreTold) {
  CounterFile file(path(), "mill");
  file.raise("anna", 1);
  file.save();
  std::filesystem::remove(path());
  std::filesystem::create_directory(path());
  EXPECT_THROW(file.save(), FileError);
  EXPECT_THROW(CounterFile("/nonexistent/folder/counters", "mill"), std::runtime_error);
}

}  // namespace
}  // namespace trn

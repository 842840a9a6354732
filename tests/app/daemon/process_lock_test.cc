#include "app/daemon/process_lock.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace trn {
namespace {

/// A private folder with a lock file that somebody else holds; its text is the test's.
class HeldLock : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = ::testing::TempDir() + "held-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string file() const { return folder_ + "/trunnion-m.lock"; }

  std::string refusal(const std::string& text) {
    std::ofstream(file()) << text;
    const int fd = open(file().c_str(), O_RDWR | O_CLOEXEC);
    EXPECT_EQ(flock(fd, LOCK_EX | LOCK_NB), 0);
    std::string told;
    try {
      const ProcessLock lock("m", {folder_});
    } catch (const std::runtime_error& error) {
      told = error.what();
    }
    close(fd);
    return told;
  }
  std::string folder_;
};

TEST_F(HeldLock, NamesWhoeverHoldsIt) {
  for (const std::string pid : {"7", "42", "4194304"}) {
    const std::string told = refusal(pid);
    EXPECT_NE(told.find("machine 'm' is already run by process " + pid + " (lock file " + file() + ")"),
              std::string::npos)
        << told;
  }
  EXPECT_NE(refusal("").find("already run by another process"), std::string::npos)
      << "it has not written yet";
}

// What a longer number left behind its own would be read as part of it.
TEST_F(HeldLock, HasTheHoldersNumberAndNothingElse) {
  std::ofstream(file()) << "99999999999";
  const ProcessLock lock("m", {folder_});
  std::ifstream in(file());
  std::string text;
  std::getline(in, text);
  EXPECT_EQ(text, std::to_string(getpid()));
}

TEST_F(HeldLock, EachMachineHasItsOwn) {
  const ProcessLock first("m", {folder_});
  EXPECT_NO_THROW(ProcessLock("n", {folder_}));
}

}  // namespace
}  // namespace trn

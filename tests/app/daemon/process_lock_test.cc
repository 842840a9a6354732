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

/// A table in a folder of its own.
class Table : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = ::testing::TempDir() + "table-XXXXXX";
    folder_ = mkdtemp(name.data());
    path_ = folder_ + "/m.var";
    std::ofstream(path_) << "5221 5\n";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string refusal(const std::string& path) {
    try {
      const TableLock lock(path, "lathe");
      return lock.missing();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }
  std::string folder_, path_;
};

TEST_F(Table, IsOneDaemonsAndTheOtherIsToldWhose) {
  {
    const TableLock lock(path_, "mill");
    EXPECT_EQ(lock.missing(), "");
    const std::string told = refusal(folder_ + "/../" + folder_.substr(folder_.rfind('/') + 1) + "/m.var");
    EXPECT_NE(told.find(path_ + " is already changed by process " + std::to_string(getpid()) +
                        " of machine 'mill'"),
              std::string::npos)
        << told;
    EXPECT_EQ(refusal(folder_ + "/other.var"), "");
  }
  EXPECT_EQ(refusal(path_), "") << "the holder has ended";
  EXPECT_EQ(refusal(""), "");
}

TEST_F(Table, OfAFolderThatCannotBeWrittenIsReadAllTheSame) {
  EXPECT_NE(refusal(folder_ + "/none/m.var"), "") << "told, and no exception";
  EXPECT_EQ(refusal(folder_ + "/none/m.var").find("is already"), std::string::npos);
  if (geteuid() != 0) GTEST_SKIP() << "needs root, to be somebody else";
  chmod(folder_.c_str(), 0755);
  ASSERT_EQ(seteuid(54321), 0);
  const std::string told = refusal(path_);
  ASSERT_EQ(seteuid(0), 0);
  EXPECT_NE(told.find("Permission denied"), std::string::npos) << told;
}

TEST_F(Table, ALockFileThatIsALinkOrAPipeIsNotFollowed) {
  ASSERT_EQ(mkfifo((path_ + ".lock").c_str(), 0600), 0);
  EXPECT_NE(refusal(path_).find("no plain file"), std::string::npos) << refusal(path_);
  std::filesystem::remove(path_ + ".lock");
  std::filesystem::create_symlink(folder_ + "/precious", path_ + ".lock");
  EXPECT_NE(refusal(path_), "");
  EXPECT_FALSE(std::filesystem::exists(folder_ + "/precious"));
}

}  // namespace
}  // namespace trn

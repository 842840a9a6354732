#include "core/safe_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "tests/support/rounds.h"

namespace trn {
namespace {

namespace fs = std::filesystem;

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::string why(const fs::path& path, std::string_view text = "new") {
  try {
    write_file_safely(path, text);
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

unsigned mode(const fs::path& path) {
  struct stat found {};
  return ::lstat(path.c_str(), &found) == 0 ? found.st_mode & 0777 : 0;
}

class SafeFile : public testing::Test {
 protected:
  SafeFile() {
    std::string name = (fs::temp_directory_path() / "trn_safe_XXXXXX").string();
    folder = ::mkdtemp(name.data());
    path = folder / "mill.var";
  }
  ~SafeFile() override { fs::remove_all(folder); }
  std::size_t count() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {}));
  }
  fs::path folder, path;
};

TEST_F(SafeFile, WritesAndReplaces) {
  write_file_safely(path, "one\n");
  EXPECT_EQ(read(path), "one\n");
  EXPECT_EQ(mode(path) & 0027, 0u) << "others have nothing to do with it";
  write_file_safely(path, "");
  EXPECT_EQ(read(path), "");
  EXPECT_EQ(count(), 1u);
}

TEST_F(SafeFile, KeepsTheModeOfAFileThatItReplaces) {
  std::ofstream(path) << "old";
  ::chmod(path.c_str(), 0664);
  write_file_safely(path, "new");
  EXPECT_EQ(mode(path), 0664u);
}

TEST_F(SafeFile, RefusesWhatIsNoFileOfItsOwn) {
  const fs::path victim = folder / "victim";
  std::ofstream(victim) << "precious";
  fs::create_symlink(victim, path);
  EXPECT_NE(why(path).find("it is a link"), std::string::npos);
  fs::create_directory(folder / "sub");
  EXPECT_NE(why(folder / "sub").find("no regular file"), std::string::npos);
  EXPECT_NE(why(folder / "sub" / ""), "");
  EXPECT_NE(why(folder / "none" / "mill.var").find("No such file"), std::string::npos);
  const fs::path other = folder / "other.var";
  fs::create_symlink(victim, folder / ".other.var.new");  // in the way of the new content
  EXPECT_EQ(why(other), "");
  EXPECT_EQ(read(victim), "precious");
  EXPECT_EQ(read(other), "new");
}

TEST_F(SafeFile, TheAdviceIsAboutTheFolderWhereNothingElseIsKnown) {
  const std::string told = why(folder / "none" / "mill.var");
  EXPECT_NE(told.find("name a file in a folder that this user may write"), std::string::npos) << told;
}

// A daemon may run without standard input: then the first file that it opens is number 0.
TEST_F(SafeFile, WritesWithoutStandardInput) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(0);
    ::_exit(why(path).empty() ? 0 : 1);
  }
  int status = 1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(read(path), "new");
}

// errno tells of the last call that failed, not of one that went well.
TEST_F(SafeFile, WhatFailedBeforeDoesNotMatter) {
  std::ofstream(path) << "old";
  std::ofstream(folder / ".mill.var.new") << "left behind by a process that was killed";
  const pid_t child = ::fork();
  if (child == 0) {
    ::alarm(10);
    errno = EINTR;
    ::_exit(why(path).empty() ? 0 : 1);
  }
  int status = 1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(read(path), "new");
}

TEST_F(SafeFile, RootKeepsTheOwner) {
  std::ofstream(path) << "old";
  if (::chown(path.c_str(), 12345, 23456) != 0) GTEST_SKIP() << "only root can give a file away";
  errno = 0;
  EXPECT_EQ(why(path), "");
  struct stat found {};
  ASSERT_EQ(::lstat(path.c_str(), &found), 0);
  EXPECT_EQ(found.st_uid, 12345u);
  EXPECT_EQ(found.st_gid, 23456u);
}

// Whoever may write a file of another user replaces it by one of his own: only root can give files away.
TEST_F(SafeFile, AnotherUsersFileIsReplacedByOnesOwn) {
  std::ofstream(path) << "old";
  ::chmod(path.c_str(), 0666);
  ::chmod(folder.c_str(), 0777);
  const pid_t child = ::fork();
  if (child == 0) {
    // By a name from here: the folders above may be closed to others.
    if (::chdir(folder.c_str()) != 0 || ::setgid(23456) != 0 || ::setuid(12345) != 0) ::_exit(2);
    ::_exit(why("mill.var").empty() ? 0 : 1);
  }
  int status = 1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  if (WEXITSTATUS(status) == 2) GTEST_SKIP() << "only root can become another user";
  EXPECT_EQ(status, 0);
  EXPECT_EQ(read(path), "new");
  EXPECT_EQ(mode(path), 0666u);
  struct stat found {};
  ASSERT_EQ(::lstat(path.c_str(), &found), 0);
  EXPECT_EQ(found.st_uid, 12345u);
}

TEST_F(SafeFile, ReadOnlyHoldsForRootToo) {
  std::ofstream(path) << "old";
  ::chmod(path.c_str(), 0444);
  EXPECT_NE(why(path).find("read-only"), std::string::npos);
  EXPECT_THROW(check_file_writable(path), FileError);
  EXPECT_EQ(read(path), "old");
  ::chmod(path.c_str(), 0644);
  EXPECT_NO_THROW(check_file_writable(path));
  EXPECT_EQ(count(), 1u);
}

// A limit of the file's size stands for the full disk: the write comes back short, then fails.
TEST_F(SafeFile, AWriteThatFailsLeavesTheOldFile) {
  std::ofstream(path) << "old";
  const pid_t child = ::fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1000, 1000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    ::_exit(why(path, std::string(5000, 'x')).empty() ? 1 : 0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0) << "the failure was told";
  EXPECT_EQ(read(path), "old");
  EXPECT_EQ(count(), 1u) << "nothing is left behind";
}

// kill -9 at any moment: the file holds one of the texts, whole, and never an older one than was
// acknowledged.
TEST_F(SafeFile, KillsLeaveAWholeFileThatIsNotOlderThanAcknowledged) {
  const int kills = test::rounds(10);
  std::mt19937 random(11);
  const auto text_of = [](int k) {
    return std::to_string(k) + "\n" + std::string(20000, static_cast<char>('a' + k % 26)) + "\n";
  };
  int last = 0;
  write_file_safely(path, text_of(last));
  for (int i = 0; i < kills; ++i) {
    int told[2];
    ASSERT_EQ(::pipe(told), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      for (int k = last + 1;; ++k) {
        write_file_safely(path, text_of(k));
        if (::write(told[1], &k, sizeof k) != sizeof k) ::_exit(1);
      }
    }
    ::close(told[1]);
    ::usleep(std::uniform_int_distribution(200, 20000)(random));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    int acknowledged = last;
    while (::read(told[0], &acknowledged, sizeof acknowledged) == sizeof acknowledged) continue;
    ::close(told[0]);
    const std::string found = read(path);
    last = std::atoi(found.c_str());
    ASSERT_EQ(found, text_of(last)) << "kill " << i;
    ASSERT_GE(last, acknowledged) << "kill " << i;
  }
}

}  // namespace
}  // namespace trn

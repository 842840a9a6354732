#include "core/plain_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

namespace trn {
namespace {

namespace fs = std::filesystem;

class PlainFile : public testing::Test {
 protected:
  PlainFile() : folder_(testing::TempDir() + "plain_file." + std::to_string(::getpid())) {
    fs::create_directories(folder_);
  }
  ~PlainFile() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return folder_ + "/" + name; }
  static std::string why(const std::string& path, std::size_t bytes_max = 1 << 20) {
    try {
      read_plain_file(path, bytes_max);
    } catch (const PlainFileError& error) {
      return error.what();
    }
    return "";
  }

  std::string folder_;
};

TEST_F(PlainFile, AFilesBytesAreReadAsTheyAre) {
  const std::string bytes = std::string("a\r\n\0b\xFF", 6) + std::string(200'000, 'x');
  std::ofstream(path("f"), std::ios::binary) << bytes;
  fs::create_symlink(path("f"), path("link"));
  EXPECT_EQ(read_plain_file(path("f"), 1 << 20), bytes);
  EXPECT_EQ(read_plain_file(path("link"), 1 << 20), bytes);
  std::ofstream(path("empty")).flush();
  EXPECT_EQ(read_plain_file(path("empty"), 1 << 20), "");
  EXPECT_NE(read_plain_file("/proc/self/status", 1 << 20).find("Pid:"), std::string::npos)
      << "says it is empty";
}

// A pipe without a writer, and a device without an end: this test would not come back.
TEST_F(PlainFile, WhatIsNoRegularFileIsRefusedAtOnce) {
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  EXPECT_EQ(why(path("pipe")), "this is no regular file but a pipe; name a file on a disk");
  EXPECT_EQ(why("/dev/zero"), "this is no regular file but a device; name a file on a disk");
  EXPECT_EQ(why(folder_), "this is a folder; name a file in it");
  EXPECT_EQ(why(folder_ + "/"), "this is a folder; name a file in it");
  EXPECT_EQ(why(path("none")), "cannot read this file: No such file or directory");
  EXPECT_EQ(why(""), "cannot read this file: No such file or directory");
  std::ofstream(path("f")) << "x";
  EXPECT_EQ(why(path("f") + std::string("\0.toml", 6)), "a file's name has no byte 0");
}

// Opened as usual, the pipe would wait for its reader.
TEST_F(PlainFile, APipeThatNobodyReadsIsNotWaitedFor) {
  const auto refusal = [](const std::string& path) -> std::string {
    try {
      ::close(open_to_write(path, 0640));
    } catch (const PlainFileError& error) {
      return error.what();
    }
    return "";
  };
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  EXPECT_TRUE(is_pipe(path("pipe")));
  EXPECT_NE(refusal(path("pipe")).find("nobody reads"), std::string::npos);
  const int reader = ::open(path("pipe").c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  EXPECT_EQ(refusal(path("pipe")), "") << "somebody reads it";
  ::close(reader);
  EXPECT_NE(refusal(folder_).find("Is a directory"), std::string::npos);
  std::ofstream(path("f")) << "old";
  EXPECT_EQ(refusal(path("f")), "");
  EXPECT_EQ(fs::file_size(path("f")), 0u);
  EXPECT_FALSE(is_pipe(path("f")));
  EXPECT_FALSE(is_pipe(path("none")));
}

// Whoever writes trunnion replay <(zcat session.log.gz) gives a pipe.
TEST_F(PlainFile, AFileThatIsNamedMayBeAPipeAndNoFolder) {
  const std::string bytes(200'000, 'x');
  std::ofstream(path("f")) << bytes;
  EXPECT_EQ(read_named_file(path("f")), bytes);
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  std::thread writer([&] { std::ofstream(path("pipe")) << bytes; });
  EXPECT_EQ(read_named_file(path("pipe")), bytes);
  writer.join();
  const auto refusal = [](const std::string& path) -> std::string {
    try {
      read_named_file(path);
    } catch (const PlainFileError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal(folder_), folder_ + ": this is a folder; name a file in it");
  EXPECT_EQ(refusal(path("none")), path("none") + ": cannot read this file: No such file or directory");
}

TEST_F(PlainFile, TheMostIsTheMost) {
  constexpr std::size_t kMega = std::size_t{1} << 20;
  std::ofstream(path("f")).flush();
  fs::resize_file(path("f"), kMega);
  EXPECT_EQ(read_plain_file(path("f"), kMega).size(), kMega);
  fs::resize_file(path("f"), kMega + 1);
  EXPECT_EQ(why(path("f"), kMega),
            "this file has more than 1 MB, the most that is legal; is it the right one?");
  fs::resize_file(path("f"), std::uintmax_t{1} << 40);  // a hole; to read it would take minutes
  EXPECT_NE(why(path("f"), kMega), "");
}

}  // namespace
}  // namespace trn

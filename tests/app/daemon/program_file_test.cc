#include "app/daemon/program_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <future>
#include <thread>

#include "interp/gcode/error.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

/// Files in a folder of the test's own.
class ProgramFile : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = ::testing::TempDir() + "program-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string write(const std::string& text) {
    const std::string path = folder_ + "/part.ngc";
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }
  std::string refusal(const ProgramFiles& files, const std::string& path) {
    try {
      const auto source = files.open(path, false);
      std::string text(1000, ' ');
      source->read(text.data(), text.size());
    } catch (const BlockError& error) {
      EXPECT_EQ(error.column, 0u) << "no place in a line is to blame";
      return error.what();
    }
    return "";
  }
  std::string folder_;
  std::atomic<bool> given_up_ = false;
  std::vector<MappedWord> words_;
};

TEST_F(ProgramFile, IsReadAsItIs) {
  std::string text;
  for (int i = 0; i < 50'000; ++i) text += "G1 X" + std::to_string(i) + "\n";
  const ProgramFiles files(given_up_, words_);
  const auto source = files.open(write(text), false);
  std::string seen(text.size() + 10, ' ');
  std::size_t size = 0;
  while (const std::size_t got = source->read(seen.data() + size, seen.size() - size)) size += got;
  seen.resize(size);
  EXPECT_EQ(seen, text);
  EXPECT_TRUE(source->seek(100));
  source->read(seen.data(), 50);
  EXPECT_EQ(seen.substr(0, 50), text.substr(100, 50));
}

TEST_F(ProgramFile, OnlyRegularFilesAreOpenedAndNobodyWaits) {
  const ProgramFiles files(given_up_, words_);
  const std::string fifo = folder_ + "/fifo";
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  EXPECT_NE(refusal(files, fifo).find("no regular file"), std::string::npos);
  EXPECT_NE(refusal(files, "/dev/zero").find("no regular file"), std::string::npos);
  EXPECT_NE(refusal(files, folder_).find("folder"), std::string::npos);
  EXPECT_NE(refusal(files, folder_ + "/none").find("No such file"), std::string::npos);
  EXPECT_EQ(files.open(folder_ + "/none", true), nullptr);
  EXPECT_EQ(files.open(folder_, true), nullptr);
}

// The share is gone: the call comes back when the test lets it.
TEST_F(ProgramFile, ACallThatDoesNotComeBackEndsInAnErrorInTime) {
  for (const bool in_open : {true, false}) {
    auto gate = std::make_shared<std::promise<void>>();
    const std::shared_future<void> released = gate->get_future().share();
    FileCalls calls = FileCalls::of_system();
    if (in_open)
      calls.open = [released, open = calls.open](const char* path) {
        released.wait();
        return open(path);
      };
    else
      calls.read = [released](int, char*, std::size_t, std::uint64_t) -> ssize_t {
        released.wait();
        return 0;
      };
    const ProgramFiles files(given_up_, words_, 0.1, calls);
    const std::string path = write("G0 X1\nM2\n");
    for (int i = 0; i < ProgramFiles::kStuckMax; ++i)
      EXPECT_NE(refusal(files, path).find("has not answered for 0.1 s"), std::string::npos);
    EXPECT_NE(refusal(files, path).find("too many files"), std::string::npos) << "threads do not pile up";
    gate->set_value();
    std::string told = "not asked yet";  // a host that stalls may still be late for a while
    for (int i = 0; i < 1000 && !told.empty(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      told = refusal(files, path);
    }
    EXPECT_EQ(told, "");
  }
}

TEST_F(ProgramFile, GivingUpEndsTheWaitingAtOnce) {
  auto gate = std::make_shared<std::promise<void>>();
  FileCalls calls = FileCalls::of_system();
  calls.open = [gate, released = gate->get_future().share()](const char*) {
    released.wait();
    return -1;
  };
  const ProgramFiles files(given_up_, words_, 3600, calls);
  auto reading = std::async(std::launch::async, [&] { return refusal(files, "x"); });
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  given_up_ = true;
  EXPECT_NE(reading.get().find("given up"), std::string::npos);
  gate->set_value();
}

TEST_F(ProgramFile, OtherTextsAreNoProgramsAndNothingOfThemIsTold) {
  const ProgramFiles files(given_up_, words_);
  for (const std::string text :
       {"root:*:20228:0:99999:7:::\ndaemon:*:20228:0:99999:7:::\n", "root:x:0:0:root:/root:/bin/bash\n",
        "-----BEGIN OPENSSH PRIVATE KEY-----\nb3BlbnNzaC1rZXktdjEAAAAABG5vbmUAAAAEbm9uZQ\n",
        "127.0.0.1 localhost\n", "PASSWORD=secret123\n", "#!/bin/sh\nexit 0\n", "{\"key\": \"secret\"}\n",
        "[Interface]\nPrivateKey = abc\n"}) {
    const std::string told = refusal(files, write(text));
    EXPECT_NE(told.find("is no program"), std::string::npos) << text << told;
    EXPECT_EQ(told.find("secret"), std::string::npos);
    EXPECT_EQ(told.find("20228"), std::string::npos);
  }
}

// A hundred lines with more than comments are looked at; comments and empty lines are none of them.
TEST_F(ProgramFile, OneOfTheFirstHundredLinesMustBeCode) {
  const auto text = [](int foreign) {
    std::string out = "(head)\n\n";
    for (int i = 0; i < foreign; ++i) out += "this is a letter\n; remark\n";
    return out + "G0 X1\n";
  };
  EXPECT_TRUE(may_be_program(text(0), words_));
  EXPECT_TRUE(may_be_program(text(99), words_));
  EXPECT_FALSE(may_be_program(text(100), words_));
}

TEST_F(ProgramFile, ProgramsArePrograms) {
  const ProgramFiles files(given_up_, words_);
  for (const std::string text :
       {"%\nO1000\nG21\n", "(only a comment)\n", "", "\r\n\r\nG0X1Y2\r\n", "; a\n; b\nN10 G21 G90\n",
        "#1=5\n", "o<sub> sub\nG0 X1\no<sub> endsub\n", "G1 X[1+\nG1 X1\n", "/G0 X1\n"})
    EXPECT_EQ(refusal(files, write(text)), "") << text;
  for (const auto& entry : std::filesystem::directory_iterator(source_dir() + "/examples")) {
    if (entry.path().extension() != ".ngc") continue;
    EXPECT_EQ(refusal(files, entry.path().string()), "") << entry.path();
  }
}

}  // namespace
}  // namespace trn

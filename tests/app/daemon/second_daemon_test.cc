#include "app/daemon/second_daemon.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>

#include "hal/lcm_link.h"
#include "tests/app/daemon/local_group.h"

// Statuses that other sockets of this host send while a daemon listens for another one.
namespace trn {
namespace {

constexpr int kPid = 4711;

LcmConfig config() { return {local_group(), "mill"}; }

std::string refusal() {
  try {
    refuse_second_daemon(config());
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

void send_status(LcmLink& link, const std::string& machine) {
  trunnion::status_t status{};
  status.pid = kPid;
  link.publish(LcmConfig{"", machine}.status_channel(), status);
}

/// Sends until it is let go, from a thread of this process.
class Speaker {
 public:
  explicit Speaker(std::string machine)
      : thread_([this, machine = std::move(machine)] {
          LcmLink link(config().url);
          while (!ended_) {
            send_status(link, machine);
            std::this_thread::yield();
          }
        }) {}
  ~Speaker() {
    ended_ = true;
    thread_.join();
  }
  Speaker(const Speaker&) = delete;
  Speaker& operator=(const Speaker&) = delete;

 private:
  std::atomic<bool> ended_ = false;
  std::thread thread_;
};

// Whoever it is; waits for it.
bool somebody_speaks(const std::string& machine) {
  LcmLink ear(config().url);
  bool heard = false;
  ear.subscribe<trunnion::status_t>(LcmConfig{"", machine}.status_channel(),
                                    [&](const auto&) { heard = true; });
  for (int i = 0; i < 1000 && !heard; ++i) ear.handle(10);
  return heard;
}

// Goes on until it is killed, or the test is.
[[noreturn]] void speak_as_nobody(const std::string& group) {
  if (setuid(65534) != 0 || prctl(PR_SET_PDEATHSIG, SIGKILL) != 0) _exit(1);
  try {
    LcmLink link(group);
    while (getppid() != 1) {
      send_status(link, "mill");
      std::this_thread::yield();
    }
  } catch (const std::exception&) {  // then nobody is heard
  }
  _exit(1);
}

class SecondDaemon : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const std::string bad = lcm_self_test(config().url); !bad.empty()) GTEST_SKIP() << bad;
  }
};

TEST_F(SecondDaemon, NobodyIsHeardWhereNobodyIs) { EXPECT_EQ(refusal(), ""); }

TEST_F(SecondDaemon, OneThatRunsTheMachineIsNamed) {
  const Speaker speaker("mill");
  ASSERT_TRUE(somebody_speaks("mill"));
  const std::string told = refusal();
  EXPECT_NE(told.find("machine 'mill' is already run: process 4711"), std::string::npos) << told;
  EXPECT_NE(told.find(config().url), std::string::npos) << told;
}

TEST_F(SecondDaemon, ADaemonOfAnotherMachineIsNone) {
  const Speaker speaker("lathe");
  ASSERT_TRUE(somebody_speaks("lathe"));
  EXPECT_EQ(refusal(), "");
}

// Whoever may open a socket could keep the machine from its daemon otherwise.
TEST_F(SecondDaemon, AnotherUsersWordDoesNotCount) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can speak as somebody else";
  const std::string group = config().url;
  const pid_t child = fork();
  if (child == 0) speak_as_nobody(group);
  EXPECT_TRUE(somebody_speaks("mill"));
  EXPECT_EQ(refusal(), "");
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
}

}  // namespace
}  // namespace trn

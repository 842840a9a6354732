#include "app/daemon/privileges.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/capability.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace trn {
namespace {

constexpr int kOtherFailure = 255, kNotGivenUp = 254;

// There is no way back, so each try is in a process of its own: 0, or errno of what failed.
int errno_in_child(const Rights& rights, const std::function<bool()>& act) {
  const pid_t child = fork();
  if (child == 0) {
    const std::vector<std::string> not_given_up = give_up_privileges(rights);
    for (const std::string& what : not_given_up) std::fprintf(stderr, "%s\n", what.c_str());
    if (!not_given_up.empty()) _exit(kNotGivenUp);
    errno = 0;
    const bool done = act();
    _exit(done ? 0 : errno != 0 ? errno : kOtherFailure);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : kOtherFailure;
}

bool opens(const std::string& path, int flags) { return open(path.c_str(), flags, 0600) >= 0; }

class Privileges : public testing::Test {
 protected:
  Privileges() {
    for (const std::string& folder : {own(), other()}) std::filesystem::create_directories(folder);
  }
  void SetUp() override {
    if (syscall(SYS_landlock_create_ruleset, nullptr, 0, 1) < 1)
      GTEST_SKIP() << "this kernel has no Landlock";
  }
  static std::string own() { return testing::TempDir() + "/own"; }
  static std::string other() { return testing::TempDir() + "/other"; }
  static int attempt(const std::function<bool()>& act) { return errno_in_child({{own()}}, act); }
};

TEST_F(Privileges, ItsOwnWorkGoesOn) {
  EXPECT_EQ(attempt([&] { return opens(own() + "/new", O_CREAT | O_WRONLY); }), 0);
  EXPECT_EQ(attempt([&] {
              std::ofstream(own() + "/a") << "text";
              return rename((own() + "/a").c_str(), (own() + "/b").c_str()) == 0 &&
                     unlink((own() + "/b").c_str()) == 0;
            }),
            0);
  EXPECT_EQ(attempt([] { return opens("/etc/passwd", O_RDONLY); }), 0);
  EXPECT_EQ(attempt([] { return opens("/dev/null", O_WRONLY); }), 0);
  EXPECT_EQ(attempt([] { return socket(AF_INET, SOCK_DGRAM, 0) >= 0; }), 0);
  EXPECT_EQ(attempt([] { return socket(AF_UNIX, SOCK_SEQPACKET, 0) >= 0; }), 0);
  EXPECT_EQ(attempt([] {
              int from_thread = 0;
              std::thread([&] { from_thread = 7; }).join();
              return from_thread == 7;
            }),
            0);
}

TEST_F(Privileges, NothingIsWrittenElsewhere) {
  const std::string file = other() + "/file";
  std::ofstream(file) << "text";
  EXPECT_EQ(attempt([&] { return opens(file, O_WRONLY); }), EACCES);
  EXPECT_EQ(attempt([&] { return opens(other() + "/new", O_CREAT | O_WRONLY); }), EACCES);
  EXPECT_EQ(attempt([&] { return unlink(file.c_str()) == 0; }), EACCES);
  EXPECT_EQ(attempt([&] { return mkdir((other() + "/folder").c_str(), 0700) == 0; }), EACCES);
  EXPECT_EQ(attempt([&] { return mknod((own() + "/device").c_str(), S_IFCHR, 0) == 0; }), EPERM);
  EXPECT_TRUE(std::filesystem::exists(file));
}

TEST_F(Privileges, NoProgramIsBegun) {
  EXPECT_EQ(attempt([] { return execl("/bin/true", "true", nullptr) == 0; }), EPERM);
  EXPECT_EQ(attempt([] { return fork() >= 0; }), EPERM);
  EXPECT_EQ(attempt([] { return vfork() >= 0; }), EPERM);
  EXPECT_EQ(attempt([] { return system("true") == 0; }), EPERM);
}

TEST_F(Privileges, NoOtherDoorsAreOpened) {
  for (const int family : {AF_PACKET, AF_VSOCK, AF_ALG, AF_BLUETOOTH, AF_XDP})
    EXPECT_EQ(attempt([&] { return socket(family, SOCK_RAW, 0) >= 0; }), EPERM) << family;
  EXPECT_EQ(attempt([] { return syscall(SYS_unshare, 0x10000000) == 0; }), EPERM);  // a user namespace
  EXPECT_EQ(attempt([] { return syscall(SYS_bpf, 0, nullptr, 0) == 0; }), EPERM);
  EXPECT_EQ(attempt([] { return syscall(SYS_ptrace, 16, 1, 0, 0) == 0; }), EPERM);
}

// Also for root, and for threads that begin later.
TEST_F(Privileges, OnlyThreeCapabilitiesStay) {
  const auto none_else = [] {
    __user_cap_header_struct head{_LINUX_CAPABILITY_VERSION_3, 0};
    __user_cap_data_struct data[2]{};
    constexpr std::uint32_t kMay = 1u << CAP_SYS_NICE | 1u << CAP_IPC_LOCK | 1u << CAP_NET_ADMIN;
    return syscall(SYS_capget, &head, data) == 0 && (data[0].permitted & ~kMay) == 0 &&
           data[1].permitted == 0 && data[0].inheritable == 0 && prctl(PR_GET_NO_NEW_PRIVS, 0, 0, 0, 0) == 1;
  };
  EXPECT_EQ(attempt(none_else), 0);
  EXPECT_EQ(attempt([&] {
              bool in_thread = false;
              std::thread([&] { in_thread = none_else(); }).join();
              return in_thread;
            }),
            0);
}

// As a process that reads and plans programs.
TEST_F(Privileges, RightsMayBeFewerOrMore) {
  const Rights least{{own()}, false, false, false}, makes_processes{{}, false, false, true};
  EXPECT_EQ(errno_in_child(least, [] { return socket(AF_UNIX, SOCK_SEQPACKET, 0) >= 0; }), EPERM);
  EXPECT_EQ(errno_in_child(least, [] { return fork() >= 0; }), EPERM);
  EXPECT_EQ(errno_in_child(least, [] { return opens(own() + "/new", O_CREAT | O_WRONLY); }), 0);
  EXPECT_EQ(errno_in_child(least,
                           [] {
                             __user_cap_header_struct head{_LINUX_CAPABILITY_VERSION_3, 0};
                             __user_cap_data_struct data[2]{};
                             return syscall(SYS_capget, &head, data) == 0 && data[0].permitted == 0 &&
                                    data[1].permitted == 0;
                           }),
            0);
  EXPECT_EQ(errno_in_child(makes_processes, [] { return opens(own() + "/new", O_CREAT | O_WRONLY); }),
            EACCES);
  EXPECT_EQ(errno_in_child(makes_processes,
                           [] {
                             const pid_t child = fork();
                             if (child == 0) _exit(0);
                             return child > 0;
                           }),
            0);
  EXPECT_EQ(errno_in_child(makes_processes, [] { return execl("/bin/true", "true", nullptr) == 0; }), EPERM);
}

}  // namespace
}  // namespace trn

#include "app/daemon/listener.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <memory>
#include <optional>
#include <string>

#include "hal/local_socket.h"
#include "tests/app/daemon/socket_bench.h"

namespace trn {
namespace {

constexpr auto kNobody = static_cast<gid_t>(-1);
constexpr uid_t kStranger = 54321;

// What a daemon leaves behind that is killed.
void leave_socket(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), path.size());
  const int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  ASSERT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  close(fd);
}

TEST(Listener, IsWhoListensAndNobodyWhereASocketWasLeft) {
  const std::string path = socket_of_test();
  EXPECT_FALSE(listener_at(path)) << "no file";
  {
    const LocalServer server(path, kNobody);
    const std::optional<Listener> found = listener_at(path);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->uid, geteuid());
    EXPECT_NE(found->text.find("process " + std::to_string(getpid())), std::string::npos) << found->text;
  }
  leave_socket(path);
  EXPECT_FALSE(listener_at(path));
  unlink(path.c_str());
}

// Another user's socket says nothing to this one, but the kernel lists it while its process lives.
TEST(Listener, IsSeenWithoutTheRightToItsSocket) {
  if (geteuid() != 0) GTEST_SKIP() << "needs root, to be somebody else";
  const std::string path = socket_of_test();
  auto server = std::make_unique<LocalServer>(path, kNobody);
  ASSERT_EQ(seteuid(kStranger), 0);
  const std::optional<Listener> found = listener_at(path);
  ASSERT_EQ(seteuid(0), 0);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->uid, 0u);
  EXPECT_NE(found->text.find("root"), std::string::npos) << found->text;
  server.reset();
  leave_socket(path);
  chmod(path.c_str(), 0600);
  ASSERT_EQ(seteuid(kStranger), 0);
  const std::optional<Listener> left = listener_at(path);
  ASSERT_EQ(seteuid(0), 0);
  EXPECT_FALSE(left) << "its process is gone";
  unlink(path.c_str());
}

}  // namespace
}  // namespace trn

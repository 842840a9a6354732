#include "app/daemon/access.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>

#include "app/client/daemon_place.h"
#include "core/config.h"

namespace trn {
namespace {

// Groups that every Debian has, by their fixed numbers.
constexpr gid_t kDaemon = 1, kBin = 2, kSys = 3;

Peer peer(std::vector<gid_t> groups) { return {4242, 30'000, std::move(groups), "anna"}; }

AccessConfig config(const std::string& look, const std::string& operate, const std::string& set_up) {
  AccessConfig out;
  out.look = look;
  out.operate = operate;
  out.set_up = set_up;
  return out;
}

TEST(AccessConfig, IsStrictAndMayBeMissing) {
  EXPECT_EQ(read_access(parse_config("", "t")).look, "trunnion");
  const AccessConfig read =
      read_access(parse_config("[access]\nsocket = \"/run/x\"\noperate = \"bin\"", "t"));
  EXPECT_EQ(read.socket, "/run/x");
  EXPECT_EQ(read.operate, "bin");
  EXPECT_THROW(read_access(parse_config("[access]\nsocket = \"x\"", "t")), ConfigError);
  EXPECT_THROW(read_access(parse_config("[access]\nlook = 3", "t")), ConfigError);
}

// A role needs its own group and those before it: who may set up may not do so from outside the door.
TEST(AccessRules, EachRoleNeedsItsGroupAndThoseBeforeIt) {
  const AccessRules rules(config("daemon", "bin", "sys"));
  EXPECT_EQ(rules.socket_group(), kDaemon);
  const struct {
    std::vector<gid_t> groups;
    bool look, operate, set_up;
  } kCases[] = {{{}, false, false, false},
                {{kDaemon}, true, false, false},
                {{100, kDaemon, kBin}, true, true, false},
                {{kDaemon, kBin, kSys}, true, true, true},
                {{kBin, kSys}, false, false, false},
                {{kDaemon, kSys}, true, false, false}};
  for (const auto& wanted : kCases) {
    EXPECT_EQ(rules.allows(peer(wanted.groups), Role::kLook), wanted.look);
    EXPECT_EQ(rules.allows(peer(wanted.groups), Role::kOperate), wanted.operate);
    EXPECT_EQ(rules.allows(peer(wanted.groups), Role::kSetUp), wanted.set_up);
  }
  EXPECT_TRUE(rules.warnings().empty());
  EXPECT_NE(rules.refusal(peer({}), Role::kOperate).find("needs group 'bin' (usermod -aG bin anna)"),
            std::string::npos);
}

TEST(AccessRules, AGroupThatIsNotNamedIsTheOneBefore) {
  const AccessRules rules(config("daemon", "", ""));
  EXPECT_TRUE(rules.allows(peer({kDaemon}), Role::kSetUp));
  EXPECT_FALSE(rules.allows(peer({kBin}), Role::kLook));
}

TEST(AccessRules, RootAndTheDaemonsUserMayDoEverything) {
  const AccessRules rules(config("no-such-group-here", "", ""));
  EXPECT_TRUE(rules.allows({1, 0, {}, "root"}, Role::kSetUp));
  EXPECT_TRUE(rules.allows({1, geteuid(), {}, "me"}, Role::kSetUp));
  EXPECT_FALSE(rules.allows(peer({kDaemon, static_cast<gid_t>(-1)}), Role::kLook));
  EXPECT_EQ(rules.socket_group(), static_cast<gid_t>(-1));
  ASSERT_EQ(rules.warnings().size(), 1u);
  EXPECT_NE(rules.warnings()[0].find("groupadd --system no-such-group-here"), std::string::npos);
}

TEST(Sockets, AClientLooksWhereTheDaemonMakesIt) {
  const std::string made = socket_to_make({}, "mill", static_cast<gid_t>(-1));
  const std::vector<std::string> tried = sockets_to_try({}, "mill");
  EXPECT_NE(std::find(tried.begin(), tried.end(), made), tried.end()) << made;
  AccessConfig named;
  named.socket = "/run/here";
  EXPECT_EQ(socket_to_make(named, "mill", static_cast<gid_t>(-1)), "/run/here");
  EXPECT_EQ(sockets_to_try(named, "mill"), std::vector<std::string>{"/run/here"});
}

}  // namespace
}  // namespace trn

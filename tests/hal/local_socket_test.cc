#include "hal/local_socket.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <system_error>

#include "tests/hal/hostile_datagrams.h"

// Both ends of real sockets, in one thread: what is sent waits in the kernel.
namespace trn {
namespace {

using trunnion::acknowledge_t;
using trunnion::command_t;

constexpr auto kNobody = static_cast<gid_t>(-1);

std::string path_of_test() {
  static int count = 0;
  return testing::TempDir() + "local" + std::to_string(++count);
}

command_t command(std::int32_t sequence) {
  command_t out{};
  out.sequence = sequence;
  return out;
}

mode_t mode_of(const std::string& path) {
  struct stat info {};
  EXPECT_EQ(stat(path.c_str(), &info), 0);
  return info.st_mode & 07777;
}

struct Bench {
  Bench() {
    server.subscribe<command_t>("c", [this](const auto& message) {
      heard.push_back(message.sequence);
      senders.push_back(server.sender());
    });
  }
  LocalServer server{path_of_test(), kNobody};
  std::vector<std::int32_t> heard;
  std::vector<ConnectionId> senders;
};

TEST(LocalSocket, CarriesMessagesBothWaysAndKnowsWhoSentThem) {
  Bench bench;
  std::vector<ConnectionId> welcomed;
  bench.server.on_connect([&](ConnectionId id) { welcomed.push_back(id); });
  LocalClient first(bench.server.path()), second(bench.server.path());
  std::vector<std::int32_t> told;
  second.subscribe<acknowledge_t>("a", [&](const auto& message) { told.push_back(message.sequence); });
  first.publish("c", command(1));
  second.publish("c", command(2));
  while (bench.server.handle(0)) {
  }
  EXPECT_EQ(bench.heard, (std::vector<std::int32_t>{1, 2}));
  ASSERT_EQ(welcomed.size(), 2u);
  EXPECT_EQ(bench.senders, welcomed);
  const Peer* peer = bench.server.peer(welcomed[1]);
  ASSERT_TRUE(peer);
  EXPECT_EQ(peer->pid, getpid());
  EXPECT_EQ(peer->uid, geteuid());
  EXPECT_TRUE(peer->is_in(getegid()));
  EXPECT_FALSE(peer->is_in(987'654));
  EXPECT_EQ(second.server().pid, getpid());
  acknowledge_t answer{};
  answer.sequence = 7;
  EXPECT_TRUE(bench.server.send(welcomed[1], "a", answer));
  EXPECT_TRUE(second.handle(1000));
  EXPECT_FALSE(first.handle(0)) << "it was not for this one";
  bench.server.broadcast("a", answer);
  EXPECT_TRUE(second.handle(1000));
  EXPECT_EQ(told, (std::vector<std::int32_t>{7, 7}));
}

TEST(LocalSocket, EachEndNoticesThatTheOtherIsGone) {
  Bench bench;
  ConnectionId last = 0;
  bench.server.on_connect([&](ConnectionId id) { last = id; });
  {
    LocalClient client(bench.server.path());
    client.publish("c", command(5));
    bench.server.handle(0);
    EXPECT_TRUE(bench.server.peer(last));
  }
  while (bench.server.handle(0)) {
  }
  EXPECT_EQ(bench.heard, std::vector<std::int32_t>{5}) << "what was sent before it went is heard";
  EXPECT_FALSE(bench.server.peer(last));
  EXPECT_FALSE(bench.server.send(last, "a", acknowledge_t{}));
  auto brief = std::make_unique<LocalServer>(path_of_test(), kNobody);
  const std::string path = brief->path();
  LocalClient client(path);
  brief.reset();
  EXPECT_FALSE(client.handle(1000));
  EXPECT_TRUE(client.closed());
  EXPECT_THROW(LocalClient{path}, std::system_error) << "the socket is gone with its server";
}

// A client that does not read costs the others nothing.
TEST(LocalSocket, AClientThatDoesNotReadKeepsNobodyWaiting) {
  Bench bench;
  LocalClient deaf(bench.server.path()), other(bench.server.path());
  std::size_t heard = 0;
  other.subscribe<acknowledge_t>("a", [&](const auto&) { ++heard; });
  while (bench.server.handle(0)) {
  }
  acknowledge_t answer{};
  answer.message = std::string(4000, 'm');
  for (int i = 0; i < 2000; ++i) {
    bench.server.broadcast("a", answer);
    while (other.handle(0)) {
    }
  }
  EXPECT_EQ(heard, 2000u);
}

// One that says a lot does not keep a quiet one from being heard: they take turns.
TEST(LocalSocket, ALoudConnectionLeavesTheOthersTheirTurn) {
  Bench bench;
  LocalClient loud(bench.server.path()), quiet(bench.server.path());
  bench.server.handle(0);
  for (int i = 0; i < 150; ++i) loud.publish("c", command(1));
  quiet.publish("c", command(2));
  bench.server.handle(0);
  EXPECT_EQ(std::count(bench.heard.begin(), bench.heard.end(), 1), 64);
  EXPECT_EQ(bench.heard.back(), 2);
  while (bench.server.handle(0)) {
  }
  EXPECT_EQ(bench.heard.size(), 151u) << "nothing is lost";
}

TEST(LocalSocket, OneUserHasABoundedNumberOfConnections) {
  Bench bench;
  std::vector<std::unique_ptr<LocalClient>> clients;
  std::size_t welcomed = 0;
  bench.server.on_connect([&](ConnectionId) { ++welcomed; });
  for (std::size_t i = 0; i < LocalServer::kConnectionsOfUserMax + 5; ++i) {
    clients.push_back(std::make_unique<LocalClient>(bench.server.path()));
    bench.server.handle(0);
  }
  EXPECT_EQ(welcomed, LocalServer::kConnectionsOfUserMax);
  EXPECT_FALSE(clients.back()->handle(1000));
  EXPECT_TRUE(clients.back()->closed());
  clients.front().reset();
  bench.server.handle(0);
  clients.push_back(std::make_unique<LocalClient>(bench.server.path()));
  bench.server.handle(0);
  EXPECT_EQ(welcomed, LocalServer::kConnectionsOfUserMax + 1) << "who goes makes room";
}

// Somebody who holds connections, and opens more all the time, keeps out nobody who says his word at once.
TEST(LocalSocket, TheOldestMakesRoomWhereASafetyCommandMustGetThrough) {
  int heard = 0;
  LocalServer server(path_of_test(), kNobody, LocalServer::WhenFull::kDropOldest);
  server.subscribe<command_t>("c", [&](const command_t& got) { heard += got.sequence == 7; });
  std::vector<std::unique_ptr<LocalClient>> hoard;
  const auto take = [&] {
    while (server.handle(0)) {
    }
  };
  for (std::size_t i = 0; i < 3 * LocalServer::kConnectionsOfUserMax; ++i) {
    hoard.push_back(std::make_unique<LocalClient>(server.path()));
    server.handle(0);
  }
  EXPECT_FALSE(hoard.front()->handle(1000));
  EXPECT_TRUE(hoard.front()->closed()) << "the oldest";
  EXPECT_FALSE(hoard.back()->handle(0));
  EXPECT_FALSE(hoard.back()->closed());
  for (int i = 1; i <= 20; ++i) {
    LocalClient stops(server.path());
    stops.publish("c", command(7));
    for (int more = 0; more < 6; ++more) hoard.push_back(std::make_unique<LocalClient>(server.path()));
    take();
    EXPECT_EQ(heard, i);
  }
}

TEST(LocalSocket, BelongsToItsGroupAndNobodyElse) {
  const LocalServer own(path_of_test(), kNobody);
  EXPECT_EQ(mode_of(own.path()), 0600u);
  const LocalServer shared(path_of_test(), getegid());
  EXPECT_EQ(mode_of(shared.path()), 0660u);
}

TEST(LocalSocket, TakesThePlaceOfAnOldSocketAndOfNothingElse) {
  const std::string path = path_of_test();
  {
    const LocalServer first(path, kNobody);
    const LocalServer again(path, kNobody);
    const LocalClient client(path);
  }
  std::ofstream(path) << "precious";
  EXPECT_THROW(LocalServer(path, kNobody), std::runtime_error);
  std::string kept;
  std::ifstream(path) >> kept;
  EXPECT_EQ(kept, "precious");
  EXPECT_THROW(LocalServer("/tmp/" + std::string(120, 'x'), kNobody), std::runtime_error) << "too long";
}

// A server that ends must not take away the file of the one that came in its place.
TEST(LocalSocket, RemovesItsOwnFileAndNoOther) {
  const std::string path = path_of_test();
  auto first = std::make_unique<LocalServer>(path, kNobody);
  EXPECT_TRUE(first->holds_path());
  auto second = std::make_unique<LocalServer>(path, kNobody);
  EXPECT_FALSE(first->holds_path());
  first.reset();
  EXPECT_TRUE(second->holds_path());
  EXPECT_NO_THROW(LocalClient{path});
  second.reset();
  EXPECT_THROW(LocalClient{path}, std::system_error);
  EXPECT_NE(unlink(path.c_str()), 0) << "the last one has removed its own";
}

TEST(LocalSocket, WhoseFileIsRemovedListensAnewAndKeepsItsConnections) {
  Bench bench;
  LocalClient before(bench.server.path());
  bench.server.handle(0);
  ASSERT_EQ(unlink(bench.server.path().c_str()), 0);
  EXPECT_FALSE(bench.server.holds_path());
  EXPECT_THROW(LocalClient{bench.server.path()}, std::system_error);
  bench.server.listen_anew(kNobody);
  EXPECT_TRUE(bench.server.holds_path());
  LocalClient after(bench.server.path());
  before.publish("c", command(1));
  after.publish("c", command(2));
  while (bench.server.handle(0)) continue;
  EXPECT_EQ(bench.heard, (std::vector<std::int32_t>{1, 2}));
}

// Short: 20,000; TRN_LONG: as many as it says.
TEST(LocalSocket, HostilePacketsEndNothing) {
  LocalServer server(path_of_test(), kNobody);
  std::uint64_t heard = 0;
  server.subscribe<command_t>("bench.command", [&](const auto&) { ++heard; });
  server.subscribe<trunnion::sensor_t>("bench.sensor", [&](const auto&) { ++heard; });
  auto client = std::make_unique<LocalClient>(server.path());
  std::mt19937_64 random(11);
  for (int i = 0; i < hostile::count(); ++i) {
    client->send_packet(hostile::datagram(random));
    server.handle(0);
    if (i % 1000 == 0) client = std::make_unique<LocalClient>(server.path());
    while (client->handle(0)) {
    }
    if (client->closed()) client = std::make_unique<LocalClient>(server.path());
  }
  EXPECT_GT(heard, 100u) << "good ones are among them";
  EXPECT_GT(server.dropped(), 100u);
}

}  // namespace
}  // namespace trn

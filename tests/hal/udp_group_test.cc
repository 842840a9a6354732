#include "hal/udp_group.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace trn {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Groups of this host only; port 0 takes any that is free, so that runs side by side do not meet.
UdpAddress here(const std::string& group = "239.255.76.67") {
  UdpAddress address = UdpAddress::parse("udpm://" + group + ":7667?ttl=0");
  address.port = 0;
  return address;
}

/// Everything that waits.
std::vector<Bytes> received(UdpReceiver& receiver) {
  std::vector<Bytes> out;
  std::span<const std::uint8_t> datagram;
  WireSender sender;
  while (receiver.receive(datagram, sender)) out.emplace_back(datagram.begin(), datagram.end());
  return out;
}

TEST(UdpGroup, TimeToLiveIsOneByte) {
  EXPECT_EQ(UdpAddress::parse("udpm://239.255.76.67:7667?ttl=255").ttl, 255);
  EXPECT_THROW(UdpAddress::parse("udpm://239.255.76.67:7667?ttl=256"), std::runtime_error);
  EXPECT_EQ(UdpAddress::parse("udpm://239.255.76.67:65535").port, 65535);
  EXPECT_THROW(UdpAddress::parse("udpm://239.255.76.67:65536"), std::runtime_error);
  EXPECT_EQ(UdpAddress::parse("udpm://239.1.2.3").port, 7667);
  EXPECT_EQ(UdpAddress::parse("udpm://239.1.2.3").text(), "239.1.2.3");
  for (const char* none : {"223.255.255.255", "240.0.0.0"})
    EXPECT_THROW(UdpAddress::parse(std::string("udpm://") + none), std::runtime_error) << none;
}

TEST(UdpGroup, WhatIsSentArrivesOnceAndInOrder) {
  UdpReceiver receiver(here());
  const UdpSender sender(here());
  EXPECT_TRUE(received(receiver).empty());
  EXPECT_FALSE(receiver.wait(0));
  const std::vector<Bytes> sent{{1}, {}, Bytes(65507, 7), {2, 3}};
  for (const Bytes& datagram : sent) ASSERT_TRUE(sender.send(datagram, receiver.port()));
  EXPECT_TRUE(receiver.wait(0));
  EXPECT_EQ(received(receiver), sent);
  EXPECT_FALSE(sender.send(Bytes(65508, 7), receiver.port())) << "more than UDP carries";
  EXPECT_TRUE(received(receiver).empty());
}

TEST(UdpGroup, TheSenderIsTold) {
  UdpReceiver receiver(here());
  const UdpSender first(here()), second(here());
  std::vector<WireSender> senders;
  for (const UdpSender* sender : {&first, &second, &first}) {
    ASSERT_TRUE(sender->send(Bytes{1}, receiver.port()));
    std::span<const std::uint8_t> datagram;
    senders.emplace_back();
    ASSERT_TRUE(receiver.receive(datagram, senders.back()));
  }
  EXPECT_NE(senders[0].port, 0);
  EXPECT_NE(senders[0], senders[1]);
  EXPECT_EQ(senders[0], senders[2]);
}

// Two groups on one port: each hears its own, whatever other programs have joined.
TEST(UdpGroup, AnotherGroupOfTheSamePortIsNotHeard) {
  UdpReceiver mine(here("239.255.76.67"));
  UdpAddress other = here("239.255.76.68");
  other.port = mine.port();
  UdpReceiver theirs(other);
  ASSERT_TRUE(UdpSender(other).send(Bytes{1}, mine.port()));
  EXPECT_TRUE(received(mine).empty());
  EXPECT_EQ(received(theirs), std::vector<Bytes>{Bytes{1}});
}

}  // namespace
}  // namespace trn

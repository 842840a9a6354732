#include "hal/lcm_link.h"

#include <gtest/gtest.h>

#include "tests/hal/hostile_datagrams.h"

namespace trn {
namespace {

using hostile::Bytes;

// The proof is the encoder's: what was handed on gives the same bytes again, so the decoder saw what was
// meant.
class Listener {
 public:
  Listener() {
    listen<trunnion::command_t>("bench.command");
    listen<trunnion::acknowledge_t>("bench.acknowledge");
    listen<trunnion::sensor_t>("bench.sensor");
    listen<trunnion::motion_t>("bench.motion");
    listen<trunnion::status_t>("bench.status");
  }
  bool hears(const Bytes& datagram) {
    now_ = &datagram;
    // exactly as many bytes as arrived: a sanitizer sees a read beyond them
    const Bytes copy(datagram.begin(), datagram.end());
    return link_.accept(copy);
  }
  LcmLink& link() { return link_; }

 private:
  template <typename Message>
  void listen(const std::string& channel) {
    link_.subscribe<Message>(channel, [this, channel](const Message& message) {
      Bytes again = hostile::datagram_of(channel, message);
      std::copy_n(now_->begin(), 8, again.begin());  // the sender's sequence number
      EXPECT_EQ(again, *now_);
    });
  }
  LcmLink link_{"memq://"};
  const Bytes* now_ = nullptr;
};

Bytes command_with_text_length(std::int32_t length) {
  trunnion::command_t command{};
  command.client = 77;
  command.verb = trunnion::command_t::RESET;
  Bytes out = hostile::datagram_of("bench.command", command);
  hostile::write_word(out, out.size() - 5, static_cast<std::uint32_t>(length));
  return out;
}

TEST(WireLayout, LengthsAndCountsThatDoNotFitAreNoMessage) {
  Listener listener;
  EXPECT_TRUE(listener.hears(command_with_text_length(1)));
  for (const std::int32_t length : {0, -1, 2, 3, 1000, 0x7fffffff, -0x7fffffff - 1})
    EXPECT_FALSE(listener.hears(command_with_text_length(length))) << length;
  trunnion::sensor_t reading{};
  const Bytes none = hostile::datagram_of("bench.sensor", reading);
  EXPECT_TRUE(listener.hears(none));
  for (const std::uint32_t count : {0xffffffffU, 0x7fffffffU, 0x80000000U, 1U}) {
    Bytes bad = none;
    hostile::write_word(bad, bad.size() - 4, count);
    EXPECT_FALSE(listener.hears(bad)) << count;
  }
  EXPECT_EQ(listener.link().dropped(), 11u);
}

TEST(WireLayout, FragmentsAndStrangersAreNoMessage) {
  Listener listener;
  std::mt19937_64 random(1);
  for (int i = 0; i < 200; ++i) EXPECT_FALSE(listener.hears(hostile::fragment(random)));
  Bytes other = hostile::datagram_of("other.command", trunnion::command_t{});
  EXPECT_FALSE(listener.hears(other));
  other[3] = '3';
  EXPECT_FALSE(listener.hears(other));
  EXPECT_FALSE(listener.hears(hostile::datagram_of("bench.status", trunnion::command_t{}))) << "its type";
  EXPECT_FALSE(read_datagram(datagram_head(1, "")));
  EXPECT_TRUE(read_datagram(datagram_head(1, std::string(kChannelBytesMax, 'c'))));
  EXPECT_FALSE(read_datagram(datagram_head(1, std::string(kChannelBytesMax + 1, 'c'))));
}

TEST(WireLayout, EverySoundMessagePassesAndEveryCutOfItDoesNot) {
  Listener listener;
  std::mt19937_64 random(2);
  for (int i = 0; i < 300; ++i) {
    const Bytes whole = hostile::sound(random);
    EXPECT_TRUE(listener.hears(whole));
    for (std::size_t size = 0; size < whole.size(); ++size)
      EXPECT_FALSE(listener.hears(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size))));
  }
}

// Short: 20,000; TRN_LONG: as many as it says.
TEST(WireLayout, HostileDatagramsReachNoDecoderUnlessTheyAreMessages) {
  Listener listener;
  std::mt19937_64 random(3);
  int heard = 0;
  for (int i = 0; i < hostile::count(); ++i) heard += listener.hears(hostile::datagram(random)) ? 1 : 0;
  EXPECT_GT(heard, hostile::count() / 10);
  EXPECT_LT(heard, hostile::count() / 2);
}

TEST(LcmLink, AHandlersExceptionStaysInside) {
  LcmLink link("memq://");
  link.subscribe<trunnion::command_t>("c", [](const auto&) { throw std::runtime_error("from a handler"); });
  link.publish("c", trunnion::command_t{});
  EXPECT_NO_THROW(link.handle(0));
}

TEST(LcmLink, AMessageTooLargeForADatagramIsRefusedNotCut) {
  LcmLink link("memq://");
  trunnion::command_t command{};
  command.text = std::string(70'000, 'x');
  EXPECT_NE(link.try_publish("c", command).find("too long"), std::string::npos);
  EXPECT_THROW(link.publish("c", command), std::runtime_error);
}

TEST(UdpAddress, IsStrict) {
  const UdpAddress address = UdpAddress::parse("udpm://239.255.76.67:7668?ttl=1");
  EXPECT_EQ(address.text(), "239.255.76.67");
  EXPECT_EQ(address.port, 7668);
  EXPECT_FALSE(address.stays_here());
  EXPECT_TRUE(UdpAddress::parse("udpm://?ttl=0").stays_here());
  EXPECT_TRUE(UdpAddress::parse("udpm://").stays_here());
  for (const char* bad :
       {"tcpq://a:1", "udpm://127.0.0.1:7667", "udpm://239.255.76.67:0", "udpm://:70000",
        "udpm://239.255.76.67:7667?ttl=-1", "udpm://239.255.76.67:7667?ttl=0&x=1", "udpm://:1x"})
    EXPECT_THROW(UdpAddress::parse(bad), std::runtime_error) << bad;
}

}  // namespace
}  // namespace trn

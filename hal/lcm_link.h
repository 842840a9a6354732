#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/config.h"
#include "hal/message_codec.h"
#include "hal/udp_group.h"

namespace trn {

/// Section [lcm] of the config, and the channel names that follow from the machine's name.
struct LcmConfig {
  static constexpr const char* kDefaultUrl = "udpm://239.255.76.67:7667?ttl=0";

  /// Key `url`: where status and motion are told to whoever listens; ttl=0 keeps every datagram on this host;
  /// empty: nothing is told.
  std::string url = kDefaultUrl;
  std::string machine;

  std::string command_channel() const { return machine + ".command"; }
  std::string acknowledge_channel() const { return machine + ".acknowledge"; }
  std::string status_channel() const { return machine + ".status"; }
  std::string sensor_channel() const { return machine + ".sensor"; }
  std::string motion_channel() const { return machine + ".motion"; }
  std::string tables_channel() const { return machine + ".tables"; }
  std::string alarms_channel() const { return machine + ".alarms"; }
  std::string scope_request_channel() const { return machine + ".scope_request"; }
  std::string scope_data_channel() const { return machine + ".scope_data"; }
  std::string scope_signals_channel() const { return machine + ".scope_signals"; }
  std::string signed_channel() const { return machine + ".signed"; }
};

/// ConfigError as ConfigTable; the section may be missing.
LcmConfig read_lcm(const ConfigTable& root, const std::string& machine_name);

/// "" if a datagram sent to the group of `url` comes back to this host; otherwise what is wrong and the
/// command that mends it. Takes at most 0.5 s. A memq:// url needs no test.
std::string lcm_self_test(const std::string& url);

/// Sends messages over UDP multicast and hears nothing: it has no socket that receives. Open to all threads.
class LcmPublisher {
 public:
  /// An empty url: nothing is sent. std::runtime_error with the remedy if this host cannot do it.
  explicit LcmPublisher(const std::string& url);

  /// "" or why the message could not be sent.
  template <typename Message>
  std::string try_publish(const std::string& channel, const Message& message) {
    return address_ ? send(encode_message(sequence_++, channel, message)) : "";
  }

 private:
  std::string send(const EncodedMessage& message) const;

  std::optional<UdpAddress> address_;
  std::optional<UdpSender> out_;
  std::atomic<std::uint32_t> sequence_ = 0;
};

/// Sends messages and hears them, over UDP multicast ("udpm://...") or, for tests, within this object
/// ("memq://"). One thread calls `handle`; publishing is open to all.
class LcmLink {
 public:
  /// std::runtime_error with the remedy if this host cannot do it.
  explicit LcmLink(const std::string& url);

  /// std::runtime_error if the message could not be sent, or is larger than a datagram.
  template <typename Message>
  void publish(const std::string& channel, const Message& message) {
    const std::string bad = try_publish(channel, message);
    if (!bad.empty()) throw std::runtime_error(bad);
  }
  /// "" or why the message could not be sent.
  template <typename Message>
  std::string try_publish(const std::string& channel, const Message& message) {
    return out_ ? out_->try_publish(channel, message) : keep(encode_message(sequence_++, channel, message));
  }

  template <typename Message>
  void subscribe(const std::string& channel, std::function<void(const Message&)> receive) {
    dispatcher_.subscribe<Message>(channel, std::move(receive));
    begin_receiving();
  }

  /// Waits up to `timeout_ms` for one message and hands it on; false if none came. No exception of a handler
  /// leaves it.
  bool handle(int timeout_ms);
  /// Hands on what is in one datagram; false if nothing is. `handle` does this with whatever arrives.
  bool accept(std::span<const std::uint8_t> datagram) { return dispatcher_.accept(datagram); }

  /// Of the message that is being handled.
  const WireSender& sender() const { return sender_; }
  /// How many datagrams came on a channel that is listened to but were no sound message of its type.
  std::uint64_t dropped() const { return dispatcher_.dropped(); }

 private:
  std::string keep(EncodedMessage message);
  void begin_receiving();
  bool take_one(bool& handed_on);
  bool take_queued(bool& handed_on);

  std::optional<UdpAddress> address_;  ///< nothing: messages stay in queue_
  std::optional<LcmPublisher> out_;
  std::unique_ptr<UdpReceiver> in_;  ///< from the first subscription on
  MessageDispatcher dispatcher_;
  std::mutex mutex_;
  std::deque<std::vector<std::uint8_t>> queue_;  ///< guarded by mutex_
  std::atomic<std::uint32_t> sequence_ = 0;
  WireSender sender_;
};

}  // namespace trn

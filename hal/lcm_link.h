#pragma once

#include <functional>
#include <memory>
#include <string>

#include "core/config.h"
#include "hal/lcm_messages.h"

namespace trn {

/// Section [lcm] of the config, and the channel names that follow from the machine's name.
struct LcmConfig {
  static constexpr const char* kDefaultUrl = "udpm://239.255.76.67:7667?ttl=0";

  std::string url = kDefaultUrl;  ///< key `url`; ttl=0 keeps every datagram on this host
  std::string machine;

  std::string command_channel() const { return machine + ".command"; }
  std::string acknowledge_channel() const { return machine + ".acknowledge"; }
  std::string status_channel() const { return machine + ".status"; }
  std::string sensor_channel() const { return machine + ".sensor"; }
  std::string motion_channel() const { return machine + ".motion"; }
};

/// ConfigError as ConfigTable; the section may be missing.
LcmConfig read_lcm(const ConfigTable& root, const std::string& machine_name);

/// "" if a datagram sent to the group of `url` comes back to this host; otherwise what is wrong and the
/// commands that mend it. Takes at most 0.5 s. Other URLs than udpm:// are not tested.
std::string lcm_self_test(const std::string& url);

/// LCM with errors as exceptions. One thread calls `handle`; publishing is open to all.
class LcmLink {
 public:
  /// std::runtime_error with the remedy if this host cannot do it.
  explicit LcmLink(const std::string& url);

  template <typename Message>
  void publish(const std::string& channel, const Message& message) {
    check(lcm_.publish(channel, &message), channel);
  }

  template <typename Message>
  void subscribe(const std::string& channel, std::function<void(const Message&)> receive) {
    handlers_.push_back(std::make_shared<Handler<Message>>(std::move(receive)));
    auto* handler = static_cast<Handler<Message>*>(handlers_.back().get());
    lcm_.subscribe(channel, &Handler<Message>::on_datagram, handler);
  }

  /// Waits up to `timeout_ms` for one message and hands it on; false if none came.
  bool handle(int timeout_ms);

 private:
  // decodes by itself: a datagram that is not a Message is dropped without a word on stderr
  template <typename Message>
  struct Handler {
    explicit Handler(std::function<void(const Message&)> f) : receive(std::move(f)) {}
    void on_datagram(const lcm::ReceiveBuffer* buffer, const std::string&) {
      Message message;
      if (message.decode(buffer->data, 0, static_cast<int>(buffer->data_size)) >= 0) receive(message);
    }
    std::function<void(const Message&)> receive;
  };

  static void check(int outcome, const std::string& channel);

  std::vector<std::shared_ptr<void>> handlers_;  // outlive lcm_, which calls them
  lcm::LCM lcm_;
};

}  // namespace trn

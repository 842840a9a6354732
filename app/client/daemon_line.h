#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "app/client/access_config.h"
#include "hal/lcm_link.h"
#include "hal/lcm_messages.h"
#include "hal/local_socket.h"

namespace trn {

/// Nobody answered in time; what() says who was asked and what to do.
struct NoAnswer : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What a client hears of the daemon.
struct DaemonListener {
  std::function<void(const trunnion::acknowledge_t&)> acknowledge;
  std::function<void(const trunnion::status_t&)> status;
  std::function<void(const trunnion::motion_t&)> motion;
  std::function<void(const trunnion::tables_t&)> tables;
  std::function<void(const trunnion::alarms_t&)> alarms = [](const auto&) {};
  /// Answers of the scope, over the daemon's socket only; may be empty.
  std::function<void(const trunnion::scope_signals_t&)> scope_signals;
  std::function<void(const trunnion::scope_data_t&)> scope_data;

  /// Hears these messages of the machine from a link that has them all.
  template <typename Link>
  void subscribe(Link& link, const LcmConfig& names) const {
    link.template subscribe<trunnion::acknowledge_t>(names.acknowledge_channel(), acknowledge);
    link.template subscribe<trunnion::status_t>(names.status_channel(), status);
    link.template subscribe<trunnion::motion_t>(names.motion_channel(), motion);
    link.template subscribe<trunnion::tables_t>(names.tables_channel(), tables);
    link.template subscribe<trunnion::alarms_t>(names.alarms_channel(), alarms);
  }
};

/// A client's way to the daemon of one machine, and back. Not thread-safe.
class DaemonLine {
 public:
  virtual ~DaemonLine() = default;

  /// Whatever is heard from now on goes there; to be called once.
  virtual void listen(const DaemonListener& listener) = 0;
  /// "", or why it cannot be sent. What was sent may still be lost, unless it is answered.
  virtual std::string send(const trunnion::command_t& command) = 0;
  virtual std::string send(const trunnion::sensor_t& readings) = 0;
  /// Waits up to `timeout_ms` for one message and hands it on; false if none came.
  virtual bool handle(int timeout_ms) = 0;
  /// Why nothing will come any more; "" while something may.
  virtual std::string ended() const = 0;
  /// How long the answer to a command takes at most, where nothing was lost.
  virtual std::chrono::milliseconds ask_again() const = 0;
  /// For people: that nobody answers within the time, for this reason ("": none is known), and what to do.
  virtual std::string silence(double timeout_s, const std::string& why) const = 0;
};

/// Over the daemon's socket, on its own host.
class SocketLine : public DaemonLine {
 public:
  /// Connects to the first socket of `sockets_to_try` that a user whom this one trusts listens at. NoAnswer
  /// if there is none within the time, or this user may not use it.
  SocketLine(const LcmConfig& names, const AccessConfig& access, double timeout_s);

  void listen(const DaemonListener& listener) override;
  std::string send(const trunnion::scope_request_t& request);
  std::string send(const trunnion::command_t& command) override;
  std::string send(const trunnion::sensor_t& readings) override;
  bool handle(int timeout_ms) override;
  std::string ended() const override;
  std::chrono::milliseconds ask_again() const override { return std::chrono::seconds(1); }
  std::string silence(double timeout_s, const std::string& why) const override;

 private:
  std::string try_connect();
  void subscribe();
  bool go_over();

  LcmConfig names_;
  AccessConfig access_;
  std::unique_ptr<LocalClient> link_;
  DaemonListener listener_;
  std::optional<trunnion::command_t> safe_;  ///< sent last, and it makes the machine safer
  bool went_over_ = false;                   ///< to the socket for such commands
};

}  // namespace trn

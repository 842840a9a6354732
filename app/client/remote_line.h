#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/client/daemon_line.h"
#include "app/client/signing_key.h"
#include "hal/lcm_link.h"

namespace trn {

/// Counters that only rise, also from one process to the next: the clock of this host in us of Unix time, or
/// one more than the last where the clock is behind that.
class RisingCounter {
 public:
  /// The last one is kept in this file; where it cannot be, the clock alone counts.
  explicit RisingCounter(std::string path);
  std::int64_t next();
  /// Writes down the last one.
  void keep() const;

 private:
  std::string path_;
  std::int64_t last_ = 0;
};

/// From another host, through the machine's gateway: what is sent is signed and goes over LCM, answers and
/// status come over LCM. These are not signed: whoever can send to the group can show this host a state that
/// is not so.
class RemoteLine : public DaemonLine {
 public:
  /// `group`: url of the gateway's group; `names.url` is where the daemon tells its status.
  /// std::runtime_error if LCM does not work on this host, KeyError if the key file cannot be used.
  RemoteLine(const LcmConfig& names, const std::string& group, const std::string& key_file);

  void listen(const DaemonListener& listener) override;
  std::string send(const trunnion::command_t& command) override;
  std::string send(const trunnion::sensor_t& readings) override;
  bool handle(int timeout_ms) override;
  std::string ended() const override { return ""; }
  std::chrono::milliseconds ask_again() const override { return std::chrono::milliseconds(100); }
  std::string silence(double timeout_s, const std::string& why) const override;

 private:
  std::string send(std::int8_t kind, std::vector<std::uint8_t> inner);

  LcmConfig names_;
  std::string group_;
  SigningKey key_;
  RisingCounter counter_;
  LcmLink gateway_;
  std::optional<LcmLink> telemetry_;  // where the daemon tells elsewhere
  bool status_heard_ = false;
};

}  // namespace trn

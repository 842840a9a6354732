#include "app/client/remote_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <fstream>
#include <utility>

#include "app/client/signed_message.h"
#include "core/safe_file.h"
#include "hal/message_codec.h"

namespace trn {

namespace {

using trunnion::signed_command_t;

constexpr int kSliceMs = 5;  // between looks at the one link while the other is waited for

std::int64_t unix_us() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}

}  // namespace

RisingCounter::RisingCounter(std::string path) : path_(std::move(path)) {
  std::ifstream file(path_);
  if (!(file >> last_)) last_ = 0;
}

std::int64_t RisingCounter::next() { return last_ = std::max(unix_us(), last_ + 1); }

void RisingCounter::keep() const {
  try {
    write_file_safely(path_, fmt::format("{}\n", last_));
  } catch (const FileError&) {  // a key on a read-only disk is as good as its host's clock
  }
}

RemoteLine::RemoteLine(const LcmConfig& names, const std::string& group, const std::string& key_file)
    : names_(names),
      group_(group),
      key_(SigningKey::read(key_file)),
      counter_(key_file + ".counter"),
      gateway_(group) {
  if (!names.url.empty() && names.url != group) telemetry_.emplace(names.url);
}

void RemoteLine::listen(const DaemonListener& listener) {
  LcmLink& telemetry = telemetry_ ? *telemetry_ : gateway_;
  gateway_.subscribe<trunnion::acknowledge_t>(names_.acknowledge_channel(), listener.acknowledge);
  telemetry.subscribe<trunnion::status_t>(names_.status_channel(),
                                          [this, status = listener.status](const auto& message) {
                                            status_heard_ = true;
                                            status(message);
                                          });
  telemetry.subscribe<trunnion::motion_t>(names_.motion_channel(), listener.motion);
  telemetry.subscribe<trunnion::tables_t>(names_.tables_channel(), listener.tables);
  telemetry.subscribe<trunnion::alarms_t>(names_.alarms_channel(), listener.alarms);
}

// A repetition is signed anew: the gateway takes no number twice, and may have lost what it did with the
// last.
std::string RemoteLine::send(std::int8_t kind, std::vector<std::uint8_t> inner) {
  const signed_command_t message =
      sign_message(key_, names_.machine, counter_.next(), kind, std::move(inner));
  const std::string bad = gateway_.try_publish(names_.signed_channel(), message);
  counter_.keep();
  return bad.empty() ? "" : "; " + bad;
}

std::string RemoteLine::send(const trunnion::command_t& command) {
  return send(signed_command_t::COMMAND, encode_inner(command));
}

std::string RemoteLine::send(const trunnion::sensor_t& readings) {
  return send(signed_command_t::SENSOR, encode_inner(readings));
}

bool RemoteLine::handle(int timeout_ms) {
  if (!telemetry_) return gateway_.handle(timeout_ms);
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(timeout_ms);
  do {
    if (telemetry_->handle(0) || gateway_.handle(std::min(kSliceMs, timeout_ms))) return true;
  } while (std::chrono::steady_clock::now() < end);
  return false;
}

std::string RemoteLine::silence(double timeout_s, const std::string& why) const {
  const char* heard =
      status_heard_ ? "its daemon's status comes here: does 'trunnion gateway' run, does the config there "
                      "have this key, and is no newer clock in use with it?"
                    : "not even its daemon's status comes here: '[lcm] url' and '[gateway] url' need a ttl "
                      "of 1 or more and a group that reaches this host";
  return fmt::format("no gateway answers for machine '{}' and key '{}' at {} within {} s{}; {}",
                     names_.machine, key_.name(), group_, timeout_s, why, heard);
}

}  // namespace trn

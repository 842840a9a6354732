#include "panel/server/mqtt_publisher.h"

#include <fmt/format.h>
#include <mosquitto.h>

#include <chrono>
#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>
#include <thread>

#include "app/client/daemon_line.h"
#include "app/client/message_json.h"
#include "panel/server/daemon_watch.h"

namespace trn {

namespace {

using nlohmann::json;
using trunnion::status_t;
using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr int kPlainPort = 1883, kTlsPort = 8883, kKeepAliveS = 10, kOnce = 1;  // at least once
constexpr auto kStep = 20ms, kWholeEvery = 1000ms, kFarewell = 1000ms;

void check(int code, std::string_view what) {
  if (code != MOSQ_ERR_SUCCESS)
    throw std::runtime_error(fmt::format("MQTT: {}: {}", what, mosquitto_strerror(code)));
}

std::string text_of_json(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

/// The library's client, its own thread, and what the broker keeps of us.
class Broker {
 public:
  Broker(const MqttConfig& config, const std::string& machine);
  ~Broker();
  Broker(const Broker&) = delete;
  Broker& operator=(const Broker&) = delete;

  /// Told again after each new connection.
  void keep(const std::string& topic, const std::string& text);
  void tell(const std::string& topic, const std::string& text) { send(topic, text, 0, false); }
  /// Once true after each new connection; then all that is kept is told anew.
  bool is_new() { return new_.exchange(false); }
  void forget() { kept_.clear(); }

 private:
  static void connected(mosquitto*, void* self, int code);
  static void disconnected(mosquitto*, void* self, int code);
  void send(const std::string& topic, const std::string& text, int quality, bool retained);

  std::string base_;
  std::unique_ptr<mosquitto, decltype(&mosquitto_destroy)> client_{nullptr, mosquitto_destroy};
  std::atomic<bool> new_ = false, there_ = false;
  std::map<std::string, std::string> kept_;
};

Broker::Broker(const MqttConfig& config, const std::string& machine)
    : base_(config.prefix + "/" + machine + "/") {
  mosquitto_lib_init();
  client_.reset(mosquitto_new(fmt::format("trunnion-{}", machine).c_str(), true, this));
  if (!client_) throw std::runtime_error("MQTT: there is no memory for a client");
  mosquitto_connect_callback_set(client_.get(), connected);
  mosquitto_disconnect_callback_set(client_.get(), disconnected);
  check(mosquitto_will_set(client_.get(), (base_ + "online").c_str(), 1, "0", kOnce, true), "last will");
  if (!config.user.empty())
    check(mosquitto_username_pw_set(client_.get(), config.user.c_str(), config.password.c_str()), "log-in");
  const bool tls = !config.authority_file.empty();
  if (tls)
    check(mosquitto_tls_set(client_.get(), config.authority_file.c_str(), nullptr, nullptr, nullptr, nullptr),
          config.authority_file);
  mosquitto_reconnect_delay_set(client_.get(), 1, 10, true);
  const int port = config.port ? config.port : tls ? kTlsPort : kPlainPort;
  // That nobody answers now is no error: the thread below tries on.
  mosquitto_connect_async(client_.get(), config.host.c_str(), port, kKeepAliveS);
  check(mosquitto_loop_start(client_.get()), "thread");
}

Broker::~Broker() {
  // A clean end sends no last will.
  send("online", "0", kOnce, true);
  std::this_thread::sleep_for(there_ ? kFarewell / 5 : 0ms);
  mosquitto_disconnect(client_.get());
  mosquitto_loop_stop(client_.get(), true);
  client_.reset();
  mosquitto_lib_cleanup();
}

void Broker::connected(mosquitto*, void* self, int code) {
  auto* broker = static_cast<Broker*>(self);
  if (code != 0) {
    std::fprintf(stderr, "mqtt: the broker refuses: %s\n", mosquitto_connack_string(code));
    return;
  }
  std::fprintf(stderr, "mqtt: connected\n");
  broker->there_ = true;
  broker->new_ = true;
}

void Broker::disconnected(mosquitto*, void* self, int code) {
  auto* broker = static_cast<Broker*>(self);
  if (broker->there_.exchange(false) && code != 0)
    std::fprintf(stderr, "mqtt: the connection is lost; trying again\n");
}

void Broker::send(const std::string& topic, const std::string& text, int quality, bool retained) {
  if (!there_) return;
  mosquitto_publish(client_.get(), nullptr, (base_ + topic).c_str(), static_cast<int>(text.size()),
                    text.data(), quality, retained);
}

// An empty text would take the topic away from the broker (MQTT 3.1.1, 3.3.1.3).
void Broker::keep(const std::string& topic, const std::string& said) {
  const std::string text = said.empty() ? "none" : said;
  const auto [known, is_first] = kept_.try_emplace(topic, text);
  if (!is_first && known->second == text) return;
  known->second = text;
  send(topic, text, kOnce, true);
}

/// What of the daemon goes to which topic.
class Teller {
 public:
  Teller(const MqttConfig& config, const LcmConfig& lcm, const AccessConfig& access)
      : config_(config),
        broker_(config, lcm.machine),
        daemon_([lcm, access] { return std::make_unique<SocketLine>(lcm, access, 0.0); }) {
    daemon_.on_status = [this] { heard_status(); };
    daemon_.on_alarms = [this] {
      broker_.keep("alarms", text_of_json(json_of(*daemon_.alarms())["alarms"]));
    };
    daemon_.on_motion = [this] { heard_motion(); };
  }

  void step() {
    if (broker_.is_new()) {
      broker_.forget();
      if (daemon_.connected() && daemon_.alarms()) daemon_.on_alarms();
      if (daemon_.connected()) heard_status();
    }
    daemon_.step();
    broker_.keep("online", daemon_.connected() ? "1" : "0");
    if (!daemon_.connected()) broker_.keep("state", "unreachable");
  }

 private:
  void heard_status() {
    const status_t& status = *daemon_.status();
    broker_.keep("state", status.state);
    broker_.keep("fault", status.fault);
    broker_.keep("alarm", status.alarm);
    broker_.keep("waits_for", status.waits_for);
    broker_.keep("program", status.program);
    broker_.keep("tool", fmt::format("{}", status.tool));
    broker_.keep("parts", fmt::format("{}", status.parts));
    broker_.keep("feed_override", fmt::format("{}", status.override_wanted));
    if (status.message != message_ && !status.message.empty()) broker_.tell("message", status.message);
    message_ = status.message;
    if (Clock::now() - status_told_ < kWholeEvery) return;
    status_told_ = Clock::now();
    broker_.keep("status", text_of_json(json_of(status)));
  }

  void heard_motion() {
    if (config_.motion_hz <= 0) return;
    const std::chrono::duration<double> since = Clock::now() - motion_told_;
    if (since.count() < 1 / config_.motion_hz) return;
    motion_told_ = Clock::now();
    broker_.tell("motion", text_of_json(json_of(*daemon_.motion())));
  }

  const MqttConfig& config_;
  Broker broker_;
  DaemonWatch daemon_;
  std::string message_;
  Clock::time_point status_told_, motion_told_;
};

void check_config(const MqttConfig& config) {
  const bool local = config.host == "localhost" || config.host.starts_with("127.");
  if (!config.password.empty() && config.authority_file.empty() && !local)
    throw std::runtime_error(
        fmt::format("a password does not cross the network to {} without TLS; name the broker's authority "
                    "with --ca",
                    config.host));
  if (config.prefix.empty() || config.prefix.find_first_of("+#") != std::string::npos)
    throw std::runtime_error(
        fmt::format("'{}' is no beginning of a topic: + and # are wildcards", config.prefix));
}

}  // namespace

void publish_over_mqtt(const MqttConfig& config, const LcmConfig& lcm, const AccessConfig& access,
                       const std::atomic<bool>& stop) {
  check_config(config);
  Teller teller(config, lcm, access);
  while (!stop) {
    teller.step();
    std::this_thread::sleep_for(kStep);
  }
}

}  // namespace trn

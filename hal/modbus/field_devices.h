#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/config.h"
#include "core/fault.h"
#include "hal/modbus/modbus_link.h"

namespace trn {

/// For threads beside the main one: signals must not end up with them.
void leave_signals_to_others();

/// One quantity of a device.
struct ModbusValueConfig {
  std::string name;  ///< "spindle.speed_rpm"
  ModbusTable table = ModbusTable::kInput;
  int address = 0;  ///< counted from 0
  bool is_signed = false;
  double scale = 1;         ///< value = register * scale
  double min = 0, max = 0;  ///< outside of it the device lies; equal: any
};
/// One device on a line.
struct ModbusDeviceConfig {
  std::string name;
  std::size_t line = 0;
  int unit = 1;
  double poll_s = 0.2, stale_s = 1.0;
  int retries = 2;
  bool required = true;  ///< a fault if it is lost; else its values only go stale
  std::vector<ModbusValueConfig> values;
};
struct ModbusConfig {
  struct Line {
    std::string name;
    ModbusAddress address;
    double timeout_s = 0.2;
  };
  std::vector<Line> lines;
  std::vector<ModbusDeviceConfig> devices;
};

/// Time of one poll of `device` on a serial line, s: request and answer of every value, 11 bits a
/// character, 3.5 characters of silence around each (Modbus over serial line 1.02, 2.5.1.1). 0 on TCP.
double poll_time_s(const ModbusAddress& address, const ModbusDeviceConfig& device);

/// Section [modbus] (it may be missing): [[modbus.line]], [[modbus.device]] with [[modbus.device.value]].
/// ConfigError as ConfigTable, also when the polls of a line do not fit into their times.
ModbusConfig read_modbus(const ConfigTable& root);

/// Modbus devices, each line in a thread of its own: polls by plan, tries again, marks what is stale, finds
/// who is gone or tells nonsense. Never in the tick.
class FieldDevices {
 public:
  struct Value {
    double value = 0;
    double age_s = 0;
    bool stale = true;
    std::int64_t time_ns = 0;  ///< steady clock, of the answer
  };
  /// Told of every reading, from the line's own thread.
  using Listener = std::function<void(const std::string& name, double value)>;

  explicit FieldDevices(const ModbusConfig& config, Listener listener = {});
  ~FieldDevices();
  FieldDevices(const FieldDevices&) = delete;
  FieldDevices& operator=(const FieldDevices&) = delete;

  /// Any thread. Nothing if there is no such value.
  std::optional<Value> value(const std::string& name) const;
  /// Whether there is such a value and its register can hold this.
  bool fits(const std::string& name, double value) const;
  /// Writes `value` (in the value's unit) with the next turn of its line; the last one asked for counts.
  /// False, with nothing sent, if there is no such value or its register cannot hold this. The latter is a
  /// fault until something that fits is asked for.
  bool write(const std::string& name, double value);
  /// Gives up what did not fit; its registers stay as they are.
  void forget_misfits();
  /// When the last written value was acknowledged, in ns of the steady clock. -1 while a value still waits
  /// for that, also where its device refuses it or its register cannot hold it.
  std::int64_t settled_ns() const;
  /// kDeviceLost or kDeviceFault of a required device as it is now, and which, in words. kDeviceFault also
  /// for what any device was to be told and its register cannot hold.
  Fault fault(std::string& detail) const;

 private:
  struct Sample {
    double value = 0;
    std::int64_t time_ns = 0;
  };
  struct DeviceState {
    std::int64_t next_ns = 0, heard_ns = 0;
    std::int64_t write_again_ns = 0;  ///< after a failure
    bool lost = false, refuses = false, lies = false;
    std::string trouble;
  };

  const ModbusValueConfig* find(const std::string& name) const;
  void serve(std::size_t line);
  void poll(ModbusLink& link, std::size_t device);
  std::string read_value(ModbusLink& link, const ModbusDeviceConfig& device, const ModbusValueConfig& value);
  void judge(std::size_t device, const std::string& trouble);
  void run_writes(ModbusLink& link, std::size_t line);
  bool take_write(const ModbusValueConfig& value, double& wanted);
  void finish_write(std::size_t device, const ModbusValueConfig& value, double wanted,
                    const std::string& trouble);

  ModbusConfig config_;
  Listener listener_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::map<std::string, Sample> samples_;
  std::map<std::string, double> writes_;
  std::map<std::string, std::string> misfits_;  ///< asked for last and not sent: why
  std::vector<DeviceState> states_;
  std::int64_t settled_ns_ = 0;
  int writing_ = 0;  ///< taken out of `writes_`, not yet acknowledged
  bool stop_ = false, news_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace trn

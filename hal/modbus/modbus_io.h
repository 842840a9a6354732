#pragma once

#include <array>
#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/config.h"
#include "core/fault.h"
#include "core/machine.h"
#include "core/ports.h"
#include "hal/modbus/field_devices.h"

namespace trn {

/// Which values of which devices are the machine's inputs and outputs; names "device.value", "": none.
struct ModbusIoConfig {
  struct Spindle {
    std::string speed;     ///< written: rpm, without sign if there is `reverse`
    std::string run;       ///< written: 1 turns, 0 stands
    std::string reverse;   ///< written: 1 counterclockwise
    std::string actual;    ///< read: rpm; ready when within `tolerance_rpm`
    std::string at_speed;  ///< read: not 0 when the speed is reached
    std::string fault;     ///< read: 0, or the inverter's fault code
    double tolerance_rpm = 50;
  };
  ModbusConfig devices;
  Spindle spindle;
  std::vector<std::string> digital_inputs, digital_outputs, analog_inputs, analog_outputs;
  std::string mist, flood;  ///< written: 1 on
};

/// Sections [modbus] and, with type = "modbus", [io]. ConfigError as ConfigTable, also for values that do not
/// exist or cannot be written.
ModbusIoConfig read_modbus_io(const ConfigTable& root);

/// The machine's inputs and outputs on Modbus devices. The tick leaves its wishes in atomics and takes the
/// last known inputs from atomics; a thread carries them to and from the devices' own threads.
class ModbusIo final : public MachineIo {
 public:
  /// `listener` is told of every reading, e.g. of temperatures.
  explicit ModbusIo(const ModbusIoConfig& config, FieldDevices::Listener listener = {});
  ~ModbusIo() override;
  ModbusIo(const ModbusIo&) = delete;
  ModbusIo& operator=(const ModbusIo&) = delete;

  void bring_up() override;
  void shut_down() noexcept override;
  void exchange(const IoOutputs& outputs, const IoPlace& place, IoInputs& inputs) TRN_RT override;
  std::string explain_fault() const override;

 private:
  void work();
  void send_outputs();
  void put(const std::string& name, double value);
  void take_inputs();
  double known(const std::string& name) const;
  bool speed_fits(double rpm) const;
  bool spindle_follows() const;
  void watch_faults();

  ModbusIoConfig config_;
  FieldDevices::Listener listener_;
  std::unique_ptr<FieldDevices> devices_;
  std::map<std::string, double> put_;  ///< the worker's: what was asked for last

  // From the tick to the worker.
  std::atomic<std::uint64_t> digital_out_ = 0;
  std::array<std::atomic<double>, kMaxIo> analog_out_{};
  std::atomic<double> rpm_ = 0;
  std::atomic<int> coolant_ = 0;
  std::atomic<std::uint32_t> spindle_commands_ = 0;
  // And back.
  std::atomic<std::uint64_t> digital_in_ = 0;
  std::array<std::atomic<double>, kMaxIo> analog_in_{};
  std::atomic<std::uint32_t> ready_for_ = 0;  ///< the spindle command that has been carried out
  std::atomic<Fault> fault_ = Fault::kOk;

  double rpm_told_ = 0;  ///< the tick's
  mutable std::mutex mutex_;
  std::string trouble_;  ///< guarded by mutex_
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace trn

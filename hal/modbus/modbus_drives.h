#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/config.h"
#include "core/fault.h"
#include "core/machine.h"
#include "core/ports.h"
#include "hal/can/cia402_axis.h"
#include "hal/modbus/field_devices.h"
#include "hal/modbus/modbus_link.h"

namespace trn {

/// One positioning drive with the words of CiA 402 in its registers. Four holding registers from `command` on
/// are written in one request: controlword, mode, target position (high word first). Four from `answer` on
/// are read in another: statusword, mode display, position (high word first).
struct ModbusAxisConfig {
  std::string name;  ///< "serial unit 3 (joint C)", for messages
  std::size_t line = 0;
  int unit = 1, joint = 0;
  int command = 0, answer = 0;                     ///< addresses, counted from 0
  ModbusTable answer_table = ModbusTable::kInput;  ///< or kHolding
  double turnaround_s = 0;                         ///< the drive's own time for an answer
  Cia402Axis::Config axis;
};
/// Section [drives] with type = "modbus".
struct ModbusDrivesConfig {
  double period_s = 0;
  std::uint32_t missed_max = 5;  ///< periods without an answer until a drive is lost
  std::vector<ModbusConfig::Line> lines;
  std::vector<ModbusAxisConfig> axes;
};

/// Time of one exchange with a drive, s: two requests and their answers, 11 bits a character and 3.5
/// characters of silence around each on a serial line (Modbus over serial line 1.02, 2.5.1.1), and the
/// drive's own time for both.
double exchange_time_s(const ModbusAddress& address, const ModbusAxisConfig& axis);

/// Reads the section; ConfigError as ConfigTable, also when a line cannot serve its drives in a period: with
/// the arithmetic and the smallest period that would do.
ModbusDrivesConfig read_modbus_drives(const Machine& machine, const ConfigTable& drives);

/// Slow positioning drives on Modbus, for machines whose period allows it. Every line has a thread that
/// exchanges registers with its drives once a period; the tick leaves its words in atomics and takes answers
/// from atomics. A setpoint acts about a period later, and is measured with the one after that.
class ModbusDrives final : public Drives {
 public:
  explicit ModbusDrives(const ModbusDrivesConfig& config);
  ~ModbusDrives() override;
  ModbusDrives(const ModbusDrives&) = delete;
  ModbusDrives& operator=(const ModbusDrives&) = delete;

  void bring_up() override;
  void shut_down() noexcept override { requests_.fetch_or(kDisable); }
  void reset_faults() override { requests_.fetch_or(kReset); }
  std::string explain_fault(int joint) const override;
  std::string health() const override;

  void exchange(const Setpoints& setpoints, Feedback& feedback) TRN_RT override;
  void request_home(unsigned joint_mask) TRN_RT override;
  void quick_stop() TRN_RT override;

 private:
  enum Request : unsigned { kEnable = 1, kDisable = 2, kReset = 4 };
  struct Axis {
    explicit Axis(const ModbusAxisConfig& axis_config) : config(axis_config), drive(axis_config.axis) {}
    ModbusAxisConfig config;
    Cia402Axis drive;  ///< the tick's, as what follows
    Cia402Axis::Input input;
    std::uint16_t controlword = 0;  ///< as told last
    std::uint64_t taken = 0;        ///< the last answer
    std::uint32_t missed = 0;
    bool lost = false;
    std::atomic<std::uint64_t> command = 0,
                               answer = 0;  ///< packed words; the last byte of an answer counts, from 1
    std::atomic<std::uint64_t> answers = 0, failures = 0;
    std::atomic<Fault> fault = Fault::kOk;
    std::atomic<std::uint16_t> statusword = 0;
    std::atomic<bool> needs_setup = true;  ///< by the tick: what it said before means nothing any more
    std::string trouble;                   ///< guarded by mutex_
  };

  struct Line {
    std::thread thread;
    std::atomic<bool> stop = false;
  };

  static void stop(Line& line);
  void set_up(std::size_t line);
  void check(ModbusLink& link, const Axis& axis) const;
  void serve(std::size_t line);
  void turn(ModbusLink& link, Axis& axis);
  void take_requests() TRN_RT;
  void step(Axis& axis, const Setpoints& setpoints) TRN_RT;
  static void report(const Axis& axis, Feedback& feedback) TRN_RT;

  ModbusDrivesConfig config_;
  std::vector<std::unique_ptr<Axis>> axes_;
  std::atomic<unsigned> requests_ = 0;
  std::atomic<std::uint32_t> ticks_ = 0;
  mutable std::mutex mutex_;
  std::vector<std::unique_ptr<Line>> lines_;
  bool follow_ = false;  ///< all drives stood enabled in the last period: they obey the setpoints
};

}  // namespace trn

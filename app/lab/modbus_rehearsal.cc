#include "app/lab/modbus_rehearsal.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <thread>

#include "app/lab/rehearsal_stage.h"
#include "app/session/make_cycle.h"
#include "core/axes.h"
#include "core/fault.h"
#include "hal/modbus/field_devices.h"
#include "hal/modbus/modbus_io.h"
#include "hal/modbus/modbus_link.h"
#include "kernel/cycle.h"
#include "kernel/rt_messages.h"
#include "sim/modbus/emulated_cabinet.h"
#include "sim/modbus/emulated_line.h"

namespace trn {

namespace {

using Clock = std::chrono::steady_clock;

constexpr double kStill = 1e-9;  // mm, rad: a setpoint that stands
constexpr const char* kMotion = "G21 G91 G94\nM3 S3000\nG1 X150 F1500\nM5\n";
constexpr std::chrono::milliseconds kLateMax{2};
constexpr int kPortFirst = 15320, kPortLast = 15400;

// Ports and names of this process in the place of those of the machine.
ModbusIoConfig localised(ModbusIoConfig config, int port) {
  for (std::size_t i = 0; i < config.devices.lines.size(); ++i) {
    ModbusAddress& address = config.devices.lines[i].address;
    if (!address.host.empty()) {
      address.host = "127.0.0.1";
      address.port = port + static_cast<int>(i);
    } else {
      const std::string name = fmt::format("trunnion_rehearsal_{}_{}", getpid(), i);
      address.device = (std::filesystem::temp_directory_path() / name).string();
      address.parity = 'N';  // a pseudo-terminal has none
    }
  }
  return config;
}

/// A machine with its cabinet, in real time; at rest is what the setpoints say.
class Stage : public RehearsalStage {
 public:
  explicit Stage(const std::string& config) : RehearsalStage(assemble(config)) {
    make_field(read_modbus_io(assembly_.machine.root));
    cycle_.reset(new Cycle(make_cycle(assembly_, queue_, ProgramStops::kPass, *assembly_.drives, io_.get(),
                                      *assembly_.rate_plans)));
    next_ = Clock::now();
  }

  int count() const { return count_; }
  const ModbusIoConfig& config() const { return config_; }
  EmulatedCabinet& cabinet() { return *cabinet_; }
  std::string explain() const override { return io_->explain_fault(); }
  void start() {
    io_->bring_up();
    assembly_.drives->bring_up();
    require(until([&] { return enabled(); }, periods(5)) >= 0);
    reset();
    require(until([&] { return ready(); }, periods(5)) >= 0);
    home();
  }
  /// Spindle on and a move along X, well on its way.
  void move() {
    start_program(kMotion);
    require(until([&] { return report().speed_mm_s > 20; }, periods(20)) >= 0);
    tick(periods(0.1));
  }
  void reset() { cycle_->post({RtCommand::Kind::kResetFault}); }
  double apart() const { return (report().q_measured - report().q_setpoint).cwiseAbs().maxCoeff(); }

 private:
  void one_period() override {
    next_ += std::chrono::nanoseconds(std::llround(1e9 * assembly_.machine.period_s));
    std::this_thread::sleep_until(next_);
    next_ = std::max(next_, Clock::now() - kLateMax);  // a period that was missed is not made up for
    ++count_;
    cabinet_->step(assembly_.machine.period_s);
    cycle_->tick();
  }
  JointVec places() const override { return report().q_setpoint; }
  void make_field(const ModbusIoConfig& real) {
    const auto values = read_emulated_values(assembly_.machine.root, real.devices);
    const int width = static_cast<int>(real.devices.lines.size());
    for (int port = kPortFirst; !cabinet_; port += width) {
      config_ = localised(real, port);
      try {
        cabinet_ = std::make_unique<EmulatedCabinet>(config_, values);
      } catch (const std::runtime_error&) {  // somebody has this port
        if (port + width > kPortLast) throw;
      }
    }
    io_ = std::make_unique<ModbusIo>(config_);
  }

  ModbusIoConfig config_;
  std::unique_ptr<EmulatedCabinet> cabinet_;
  std::unique_ptr<ModbusIo> io_;
  Clock::time_point next_;
  int count_ = 0;  ///< periods so far
};

struct Row {
  std::string cause, device;
  EmulatedLine::Trouble trouble;
  Fault fault;
};

// A lie is seen where a range says what is possible, or a register says what is wrong.
bool shows_lies(const ModbusIoConfig& config, const ModbusDeviceConfig& device) {
  return std::any_of(device.values.begin(), device.values.end(), [&](const ModbusValueConfig& value) {
    const bool registers = value.table == ModbusTable::kInput || value.table == ModbusTable::kHolding;
    return registers && (value.max > value.min || value.name == config.spindle.fault);
  });
}

std::vector<Row> rows(const ModbusIoConfig& config) {
  std::vector<Row> out;
  for (const ModbusDeviceConfig& device : config.devices.devices) {
    const Fault lost = device.required ? Fault::kDeviceLost : Fault::kOk;
    const Fault lies = device.required ? Fault::kDeviceFault : Fault::kOk;
    const double timeout_s = config.devices.lines[device.line].timeout_s;
    const int slow_ms = static_cast<int>(std::ceil(2000 * timeout_s));
    const int late_ms = std::max(1, static_cast<int>(200 * timeout_s));
    out.push_back({device.name + " unplugged", device.name, {true, false, 0, 0}, lost});
    out.push_back({device.name + " answers by halves", device.name, {false, true, 0, 0}, lost});
    out.push_back({fmt::format("{} slow by {} ms", device.name, slow_ms),
                   device.name,
                   {false, false, slow_ms, 0},
                   lost});
    out.push_back({fmt::format("{} slow by {} ms", device.name, late_ms),
                   device.name,
                   {false, false, late_ms, 0},
                   Fault::kOk});
    if (shows_lies(config, device))
      out.push_back({device.name + " lies", device.name, {false, false, 0, 30000}, lies});
  }
  return out;
}

// What is not required may be silent for as long as it likes; the motion goes on.
double patience_s(const ModbusIoConfig& config, const Row& row) {
  for (const ModbusDeviceConfig& device : config.devices.devices)
    if (device.name == row.device)
      return row.fault == Fault::kOk ? device.stale_s + 0.5 : device.stale_s + 10 * device.poll_s + 5;
  return 5;
}

// A device that is back is heard by its next polls; who resets before that is told again, and resets again.
int recover(Stage& stage) {
  const int from = stage.count();
  while (stage.count() - from < stage.periods(10)) {
    stage.reset();
    stage.tick(2);
    const int taken = stage.count() - from;
    const int again = stage.until([&] { return stage.report().fault != Fault::kOk; }, stage.periods(0.2));
    if (again < 0 && stage.ready()) return taken;
    stage.tick(5);
  }
  return -1;
}

RehearsedFault rehearse(const std::string& config, const Row& row) {
  Stage stage(config);
  stage.start();
  stage.move();
  RehearsedFault out;
  out.cause = row.cause;
  out.wanted = row.fault;
  stage.cabinet().trouble(row.device, row.trouble);
  const int limit = stage.periods(patience_s(stage.config(), row));
  out.to_fault = stage.until([&] { return stage.report().fault != Fault::kOk; }, limit);
  if (out.to_fault >= 0) out.message = stage.explain();
  const int rest = stage.wait_for_rest(kStill);
  out.to_rest = rest < 0 ? -1 : rest + std::max(out.to_fault, 0);
  out.fault = stage.report().fault;
  out.crept = stage.moves_in(stage.periods(0.5));
  stage.cabinet().trouble(row.device, {});
  out.to_recover = recover(stage);
  out.kept_position = stage.homed() && stage.apart() < 1e-3;
  return out;
}

}  // namespace

std::vector<RehearsedFault> rehearse_modbus_faults(const std::string& config,
                                                   const std::function<void(const RehearsedFault&)>& on_row) {
  std::vector<RehearsedFault> out;
  const ModbusIoConfig io = read_modbus_io(assemble(config).machine.root);
  if (io.devices.devices.empty())
    throw std::runtime_error("this machine has no Modbus devices ([[modbus.device]]): nothing to rehearse");
  for (const Row& row : rows(io)) {
    out.push_back(rehearse(config, row));
    if (on_row) on_row(out.back());
  }
  return out;
}

}  // namespace trn

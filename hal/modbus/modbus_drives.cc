#include "hal/modbus/modbus_drives.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "core/check.h"
#include "hal/drive_requests.h"
#include "hal/drive_severity.h"

namespace trn {

namespace {

constexpr auto kLook = std::chrono::microseconds(500);  // of a line's thread, for the next period
constexpr int kWords = 4;

std::uint64_t pack(std::uint16_t word, std::int8_t mode, std::int32_t position, std::uint8_t count) TRN_RT {
  // One atomic word holds all that belongs together, so neither side ever sees the position of one period
  // with the mode of another.
  return std::uint64_t{word} << 48 | std::uint64_t{static_cast<std::uint8_t>(mode)} << 40 |
         std::uint64_t{static_cast<std::uint32_t>(position)} << 8 | count;
}
std::uint16_t word_of(std::uint64_t packed) TRN_RT { return static_cast<std::uint16_t>(packed >> 48); }
std::int8_t mode_of(std::uint64_t packed) TRN_RT { return static_cast<std::int8_t>(packed >> 40 & 0xFF); }
std::int32_t position_of(std::uint64_t packed) TRN_RT {
  return static_cast<std::int32_t>(packed >> 8 & 0xFFFFFFFF);
}

std::vector<std::uint16_t> registers_of(std::uint64_t packed) {
  const auto position = static_cast<std::uint32_t>(position_of(packed));
  return {word_of(packed), static_cast<std::uint16_t>(mode_of(packed)),
          static_cast<std::uint16_t>(position >> 16), static_cast<std::uint16_t>(position)};
}

}  // namespace

ModbusDrives::ModbusDrives(const ModbusDrivesConfig& config) : config_(config) {
  for (const ModbusAxisConfig& axis : config.axes) axes_.push_back(std::make_unique<Axis>(axis));
  for (std::size_t line = 0; line < config.lines.size(); ++line) lines_.push_back(std::make_unique<Line>());
}

ModbusDrives::~ModbusDrives() {
  for (auto& line : lines_) stop(*line);
}

void ModbusDrives::stop(Line& line) {
  line.stop = true;
  if (line.thread.joinable()) line.thread.join();
  line.stop = false;
}

// A line on which all is well goes on: its drives may be enabled, and must not miss a period.
void ModbusDrives::bring_up() {
  requests_.fetch_or(kComingUp);
  for (std::size_t line = 0; line < lines_.size(); ++line)
    if (std::any_of(axes_.begin(), axes_.end(), [&](const auto& axis) {
          return axis->config.line == line && axis->needs_setup.load(std::memory_order_acquire);
        }))
      set_up(line);
  ask_unless_stopped(requests_, kEnable);
}

void ModbusDrives::set_up(std::size_t line) {
  stop(*lines_[line]);
  ModbusLink link(config_.lines[line].address, config_.lines[line].timeout_s);
  for (auto& axis : axes_) {
    if (axis->config.line != line) continue;
    // One question to each drive before its thread starts, so that a wrong address is told by name and not as
    // a drive that is lost a second later.
    check(link, *axis);
    // What the drive said before it was lost means nothing any more; 0 is no answer.
    if (axis->needs_setup.exchange(false)) axis->answer = 0;
  }
  lines_[line]->thread = std::thread([this, line] { serve(line); });
}

void ModbusDrives::check(ModbusLink& link, const Axis& axis) const {
  std::vector<std::uint16_t> words;
  const ModbusAxisConfig& config = axis.config;
  std::string trouble = link.read(config.unit, config.answer_table, config.answer, kWords, words);
  if (!trouble.empty())  // one answer may be lost
    trouble = link.read(config.unit, config.answer_table, config.answer, kWords, words);
  if (trouble.empty()) return;
  throw std::runtime_error(
      fmt::format("{}: {}; is the drive on, and are unit, speed of the line and 'answer' ({}) those of its "
                  "manual?",
                  config.name, trouble, config.answer));
}

void ModbusDrives::serve(std::size_t line) {
  leave_signals_to_others();
  ModbusLink link(config_.lines[line].address, config_.lines[line].timeout_s);
  std::uint32_t seen = ticks_;
  while (!lines_[line]->stop) {
    const std::uint32_t now = ticks_.load(std::memory_order_acquire);
    if (now == seen) {
      // The tick must not wake anybody (a system call that may wait), so this thread looks for itself, many
      // times in a period of some tens of ms.
      std::this_thread::sleep_for(kLook);
      continue;
    }
    seen = now;
    for (const auto& axis : axes_)
      if (axis->config.line == line) turn(link, *axis);
  }
}

void ModbusDrives::turn(ModbusLink& link, Axis& axis) {
  const ModbusAxisConfig& config = axis.config;
  // The newest command, also if the line has missed some: of a setpoint only the last one counts.
  const std::uint64_t command = axis.command.load(std::memory_order_relaxed);
  std::vector<std::uint16_t> words;
  // First the command, then the answer: what is read has seen this period's command.
  std::string trouble = link.write(config.unit, ModbusTable::kHolding, config.command, registers_of(command));
  if (trouble.empty()) trouble = link.read(config.unit, config.answer_table, config.answer, kWords, words);
  if (!trouble.empty()) {
    axis.failures.fetch_add(1, std::memory_order_relaxed);
    const std::lock_guard lock(mutex_);
    axis.trouble = trouble;
    return;
  }
  // The count from 1 to 255 makes two answers with the same values differ, so that a drive at rest still
  // counts as heard.
  const auto count =
      static_cast<std::uint8_t>(axis.answers.fetch_add(1, std::memory_order_relaxed) % 255 + 1);
  const auto position = static_cast<std::int32_t>(std::uint32_t{words[2]} << 16 | words[3]);
  axis.answer.store(pack(words[0], static_cast<std::int8_t>(words[1]), position, count),
                    std::memory_order_release);
}

void ModbusDrives::take_requests() TRN_RT {
  const unsigned requests = take_asked(requests_);
  for (auto& axis : axes_) {
    if (requests & kReset) {
      axis->drive.reset();
      axis->lost = false;
      axis->missed = 0;
    }
    if (requests & kDisable)
      axis->drive.disable();
    else if (requests & kEnable)  // of a bring-up that has just ended: off means off
      axis->drive.enable();
  }
}

void ModbusDrives::step(Axis& axis, const Setpoints& setpoints) TRN_RT {
  const std::uint64_t answer = axis.answer.load(std::memory_order_acquire);
  const bool fresh = answer != axis.taken && answer != 0;
  axis.taken = answer;
  axis.input = {word_of(answer), position_of(answer), mode_of(answer), fresh};
  axis.missed = fresh ? 0 : axis.missed + 1;
  // A drive that was never heard is not lost; bring-up tells of it.
  if (axis.missed > config_.missed_max && axis.drive.measured_once()) {
    axis.lost = true;
    axis.drive.fail(Fault::kDriveLost);
  }
  Cia402Axis::Output out;
  const auto joint = static_cast<Eigen::Index>(axis.config.joint);
  axis.drive.step(axis.input, setpoints.q[joint], setpoints.qd[joint], follow_ && !axis.lost, out);
  axis.controlword = out.controlword;
  axis.command.store(pack(out.controlword, out.mode, out.position, 0), std::memory_order_relaxed);
  axis.statusword.store(axis.input.statusword, std::memory_order_relaxed);
  axis.fault.store(axis.drive.fault(), std::memory_order_relaxed);
  // The line of such a drive is checked anew at the next reset.
  if (fault_info(axis.drive.fault()).reaction == Reaction::kQuickStop)
    axis.needs_setup.store(true, std::memory_order_release);
}

void ModbusDrives::exchange(const Setpoints& setpoints, Feedback& feedback) TRN_RT {
  TRN_CHECK(setpoints.q.allFinite());
  take_requests();
  feedback.state = DriveState::kEnabled;
  feedback.fault = Fault::kOk;
  feedback.fault_joint = -1;
  feedback.homed_mask = feedback.limit_switch_mask = 0;
  for (auto& axis : axes_) {
    step(*axis, setpoints);
    report(*axis, feedback);
  }
  ticks_.fetch_add(1, std::memory_order_release);
  follow_ = feedback.state == DriveState::kEnabled;
}

void ModbusDrives::report(const Axis& axis, Feedback& feedback) TRN_RT {
  const int joint = axis.config.joint;
  feedback.q[joint] = axis.drive.measured();
  TRN_CHECK(joint >= 0 && joint < feedback.q.size());
  feedback.words[static_cast<std::size_t>(joint)] = {axis.input.statusword, axis.controlword};
  if (axis.drive.homed()) feedback.homed_mask |= 1u << joint;
  feedback.state = worst(feedback.state, axis.lost ? DriveState::kLost : axis.drive.state());
  const Fault worst_fault = worse(feedback.fault, axis.drive.fault());
  if (worst_fault == feedback.fault) return;
  feedback.fault = worst_fault;
  feedback.fault_joint = joint;
}

void ModbusDrives::request_home(unsigned joint_mask) TRN_RT {
  for (auto& axis : axes_)
    if (joint_mask >> axis->config.joint & 1u) axis->drive.home();
}

void ModbusDrives::quick_stop() TRN_RT {
  take_back(requests_, kEnable);
  for (auto& axis : axes_) axis->drive.quick_stop();
}

std::string ModbusDrives::explain_fault(int joint) const {
  for (const auto& axis : axes_) {
    const Fault fault = axis->fault;
    if ((joint >= 0 && axis->config.joint != joint) || fault == Fault::kOk) continue;
    if (fault == Fault::kDriveLost) {
      const std::lock_guard lock(mutex_);
      return fmt::format("{}: no answer for more than {} periods; {}", axis->config.name, config_.missed_max,
                         axis->trouble);
    }
    const std::uint16_t status = axis->statusword;
    return fmt::format("{}: {}; statusword = 0x{:04X} ({})", axis->config.name, fault_info(fault).meaning,
                       status, describe_statusword(status));
  }
  return "";
}

std::string ModbusDrives::health() const {
  std::vector<std::string> parts;
  for (const auto& axis : axes_)
    parts.push_back(fmt::format("{}: {} answers, {} failures", axis->config.name, axis->answers.load(),
                                axis->failures.load()));
  return fmt::format("{}", fmt::join(parts, "; "));
}

}  // namespace trn

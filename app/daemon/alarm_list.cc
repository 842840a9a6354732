#include "app/daemon/alarm_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "app/daemon/telemetry.h"

namespace trn {

namespace {

constexpr std::size_t kTextBytesMax = 400;  // 32 alarms and their texts fit into one packet

std::string did(Reaction reaction, MachineState before) {
  const bool moved = before == MachineState::kRunning || before == MachineState::kHolding ||
                     before == MachineState::kStopping || before == MachineState::kJogging ||
                     before == MachineState::kHoming;
  const std::string end = before == MachineState::kRunning || before == MachineState::kHolding
                              ? "; the program was given up"
                              : "";
  if (reaction == Reaction::kNone) return "the machine went on";
  if (reaction == Reaction::kPathStop)
    return (moved ? "the machine stopped on its path, the drives kept their power" : "nothing moved") + end;
  return "the drives braked, each by its own ramp, and lost their power" + end;
}

std::string cut(const std::string& text) { return text.substr(0, kTextBytesMax); }

}  // namespace

Alarm fault_alarm(Fault fault, const std::string& joint, const std::string& detail, MachineState before) {
  const FaultInfo& info = fault_info(fault);
  Alarm alarm;
  alarm.name = info.name;
  alarm.text = fmt::format("{}{}{}{}", info.meaning, joint.empty() ? "" : "; joint ", joint,
                           detail.empty() ? "" : "; " + detail);
  alarm.cure = info.remedy;
  alarm.did = did(info.reaction, before);
  alarm.active = true;
  return alarm;
}

void AlarmList::raise(Alarm alarm) {
  news_ = true;
  alarm.text = cut(alarm.text);
  const auto same = std::find_if(alarms_.begin(), alarms_.end(), [&](const Alarm& other) {
    return !other.acknowledged && other.name == alarm.name && other.text == alarm.text;
  });
  if (same != alarms_.end()) {
    ++same->times;
    same->active = alarm.active;
    return;
  }
  alarm.cure = cut(alarm.cure);
  alarm.number = ++count_;
  alarm.since_us = unix_time_us();
  if (alarms_.size() == kMax) {
    const auto old = std::find_if(alarms_.begin(), alarms_.end(), [](const Alarm& a) { return !a.active; });
    alarms_.erase(old == alarms_.end() ? alarms_.begin() : old);
  }
  alarms_.push_back(std::move(alarm));
}

void AlarmList::over(std::string_view name) {
  for (Alarm& alarm : alarms_) {
    if (!alarm.active || !(name.empty() || alarm.name == name)) continue;
    alarm.active = false;
    news_ = true;
  }
  forget();
}

bool AlarmList::acknowledge(std::int64_t number) {
  bool found = false;
  for (Alarm& alarm : alarms_) {
    if (number != 0 && alarm.number != number) continue;
    found = alarm.acknowledged = news_ = true;
  }
  forget();
  return found || number == 0;
}

void AlarmList::forget() {
  std::erase_if(alarms_, [](const Alarm& alarm) { return alarm.acknowledged && !alarm.active; });
}

int AlarmList::open() const {
  return static_cast<int>(
      std::count_if(alarms_.begin(), alarms_.end(), [](const Alarm& alarm) { return !alarm.acknowledged; }));
}

std::string AlarmList::newest() const {
  const auto found =
      std::find_if(alarms_.rbegin(), alarms_.rend(), [](const Alarm& alarm) { return !alarm.acknowledged; });
  return found == alarms_.rend() ? "" : fmt::format("{}: {}", found->name, found->text);
}

bool AlarmList::take_news() { return std::exchange(news_, false); }

trunnion::alarms_t AlarmList::message() const {
  trunnion::alarms_t out{};
  out.alarm_count = static_cast<std::int32_t>(alarms_.size());
  for (const Alarm& alarm : alarms_) {
    out.alarm_number.push_back(alarm.number);
    out.alarm_name.push_back(alarm.name);
    out.alarm_text.push_back(alarm.text);
    out.alarm_cure.push_back(alarm.cure);
    out.alarm_did.push_back(alarm.did);
    out.alarm_program.push_back(cut(alarm.program));
    out.alarm_line.push_back(alarm.line);
    out.alarm_cause.push_back(cut(alarm.cause));
    out.alarm_since_us.push_back(alarm.since_us);
    out.alarm_times.push_back(alarm.times);
    out.alarm_active.push_back(alarm.active);
    out.alarm_acknowledged.push_back(alarm.acknowledged);
  }
  return out;
}

}  // namespace trn

#include "app/session/session_log.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "app/session/block_delete_json.h"
#include "app/session/feature_report.h"
#include "app/session/json_numbers.h"
#include "app/session/measured_json.h"
#include "app/session/tick_commands.h"
#include "core/axes.h"
#include "core/check.h"
#include "core/plain_file.h"
#include "core/safe_file.h"
#include "interp/gcode/parameter_file.h"
#include "interp/move.h"

namespace trn {

namespace {

using Json = nlohmann::json;
using Kind = SessionEntry::Kind;

constexpr int kLogsMax = 100'000;
constexpr auto kTryAgain = std::chrono::seconds(1);

// In the order of the enumerations.
constexpr const char* kEntryNames[] = {
    "program",    "command",  "low",    "stands", "fault",        "inputs",     "answer",      "sensor",
    "rate_plans", "features", "drives", "held",   "block_delete", "taken_back", "delete_tool", "gap"};
constexpr const char* kDriveNames[] = {"off", "starting", "enabled", "homing", "quick_stop", "fault", "lost"};
static_assert(std::size(kEntryNames) == static_cast<std::size_t>(Kind::kGap) + 1);
static_assert(std::size(kDriveNames) == static_cast<std::size_t>(DriveState::kLost) + 1);

template <typename Vector>
std::vector<double> numbers(const Vector& q) {
  return {q.data(), q.data() + q.size()};
}

JointVec joints(const std::vector<double>& numbers) {
  if (numbers.size() > kMaxJoints) throw std::runtime_error("more joints than a machine may have");
  return Eigen::Map<const Eigen::VectorXd>(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
}

template <typename Names>
std::size_t index_of(const Names& names, const std::string& name) {
  for (std::size_t i = 0; i < std::size(names); ++i)
    if (name == names[i]) return i;
  throw std::runtime_error(fmt::format("'{}' is not known", name));
}

RtCommand::Kind tick_command_called(const std::string& name) {
  for (const TickCommandRow& row : kTickCommands)
    if (row.name == name) return row.kind;
  throw std::runtime_error(fmt::format("'{}' is not known", name));
}

// By name; earlier logs have its number.
Fault fault_of(const Json& json) {
  if (json.is_string()) {
    const std::string name = json.get<std::string>();
    if (!find_fault(name)) throw std::runtime_error(fmt::format("fault '{}' is not known", name));
    return fault_named(name);
  }
  const int number = whole<int>(json);
  if (number < 0 || number >= static_cast<int>(Fault::kCount))
    throw std::runtime_error(fmt::format("fault {} is not known", number));
  return static_cast<Fault>(number);
}

// The text of an MDI line may be any bytes.
std::string one_line(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json to_json(const SessionHead& head) {
  return {{"machine", head.machine}, {"tools", head.tools},           {"vars", head.vars},
          {"run", head.run},         {"tools_text", head.tools_text}, {"vars_text", head.vars_text}};
}

Json to_json(const SessionEntry& entry) {
  TRN_CHECK(static_cast<std::size_t>(entry.kind) < std::size(kEntryNames));
  Json json{{"period", entry.period}, {"entry", kEntryNames[static_cast<std::size_t>(entry.kind)]}};
  if (entry.kind == Kind::kProgram) {
    json["path"] = entry.program.path;
    if (entry.program.from_line > 1) json["from_line"] = entry.program.from_line;
    if (entry.program.from_block > 0) json["from_block"] = entry.program.from_block;
    if (entry.program.from_place) json["from_place"] = numbers_of(*entry.program.from_place);
    if (entry.program.text) json["text"] = *entry.program.text;
    if (const auto& on = entry.program.outputs)
      json["outputs"] = {{"rpm", on->rpm},
                         {"coolant", on->coolant},
                         {"rpm_known", on->rpm_known},
                         {"broken_off", on->broken_off}};
    json["corrections_off"] = entry.program.switches.corrections_off;
    json["block_delete"] = entry.program.switches.block_delete;
    json["optional_stop"] = entry.program.switches.optional_stop;
    json["dry_run"] = entry.program.switches.dry_run;
    if (entry.program.began.size() > 0) json["began"] = numbers(entry.program.began);
    if (!entry.program.block_delete_changes.empty())
      json["block_delete_changes"] = changes_json(entry.program.block_delete_changes);
    if (!entry.program.measured.empty()) json["measured_values"] = measured_json(entry.program.measured);
  }
  if (entry.kind == Kind::kProgram || entry.kind == Kind::kStands) json["q"] = numbers(entry.program.q);
  if (entry.kind == Kind::kStands) json["measured"] = numbers(entry.q_measured);
  if (entry.kind == Kind::kDrives) json["state"] = kDriveNames[static_cast<std::size_t>(entry.drives)];
  if (entry.kind == Kind::kLow) json["blocks"] = entry.blocks;
  if (entry.kind == Kind::kRatePlans) json["late"] = entry.late;
  if (entry.kind == Kind::kFault) json["fault"] = fault_info(entry.fault).name;
  if (entry.kind == Kind::kFault) json["joint"] = entry.joint;
  if (entry.kind == Kind::kInputs) {
    json["digital"] = entry.inputs.digital;
    json["probe"] = entry.inputs.probe;
    json["spindle_ready"] = entry.inputs.spindle_ready;
    json["turns"] = entry.inputs.spindle_turns;
  }
  if (entry.kind == Kind::kAnswer) {
    json["value"] = entry.answer.value;
    if (entry.answer.probe) json["contact"] = numbers(entry.answer.q_contact);
    if (entry.answer.probe) json["stands"] = numbers(entry.answer.y_stand);
  }
  if (entry.kind == Kind::kSensor) {
    json["channel"] = entry.sensor.channel;
    json["value"] = entry.sensor.value;
  }
  if (entry.kind == Kind::kFeatures) json["features"] = features_json(entry.features);
  if (entry.kind == Kind::kHeld) {
    json["block"] = entry.held.after_block;
    json["text"] = entry.held.text;
    json["at"] = entry.held.stands;
  }
  if (entry.kind == Kind::kDeleteTool) json["tool"] = entry.tool;
  if (entry.kind == Kind::kTakenBack) json["behind"] = entry.taken_back;
  if (entry.kind == Kind::kBlockDelete) json["changes"] = changes_json({entry.change});
  if (entry.kind == Kind::kGap) {
    json["since"] = entry.since;
    json["lost"] = entry.lost;
  }
  if (entry.kind != Kind::kCommand) return json;
  TRN_CHECK(entry.command.kind < RtCommand::Kind::kCount);
  json["command"] = kTickCommands[static_cast<std::size_t>(entry.command.kind)].name;
  json["value"] = entry.command.value;
  json["speed"] = entry.command.speed;
  json["joint"] = entry.command.joint;
  return json;
}

ProgramAnswer answer_from(const Json& json) {
  ProgramAnswer answer;
  answer.value = json.at("value");
  answer.probe = json.contains("contact");
  if (!answer.probe) return answer;
  answer.q_contact = joints(json.at("contact"));
  const std::vector<double> stands = json.at("stands");
  if (stands.size() != 6) throw std::runtime_error("a place has six words");
  answer.y_stand = Eigen::Map<const Words>(stands.data());
  return answer;
}

SensorSample sensor_from(const Json& json) {
  const SensorSample sample{whole<int>(json.at("channel")), json.at("value")};
  if (sample.channel < 0 || sample.channel >= SensorBoard::kMax) throw std::runtime_error("no such channel");
  return sample;
}

SessionEntry from_json(const Json& json) {
  SessionEntry entry;
  entry.period = whole<std::uint64_t>(json.at("period"));
  entry.kind = static_cast<Kind>(index_of(kEntryNames, json.at("entry")));
  if (entry.kind == Kind::kProgram) {
    entry.program.path = json.at("path");
    if (json.contains("from_line")) entry.program.from_line = whole<std::uint32_t>(json.at("from_line"));
    if (json.contains("from_block")) entry.program.from_block = whole<std::uint64_t>(json.at("from_block"));
    if (json.contains("from_place")) {
      entry.program.from_place = entry_place(json.at("from_place").get<std::vector<double>>());
      if (!entry.program.from_place) throw std::runtime_error("a place has six words, and a share");
    }
    if (json.contains("text")) entry.program.text = json.at("text").get<std::string>();
    if (json.contains("outputs")) {
      const Json& on = json.at("outputs");
      entry.program.outputs = {on.at("rpm"), whole<int>(on.at("coolant")), on.at("rpm_known"),
                               on.at("broken_off")};
    }
    if (json.contains("corrections_off"))
      entry.program.switches.corrections_off = whole<std::uint8_t>(json.at("corrections_off"));
    entry.program.switches.block_delete = json.value("block_delete", false);
    entry.program.switches.optional_stop = json.value("optional_stop", true);
    entry.program.switches.dry_run = json.value("dry_run", false);
    if (json.contains("began")) entry.program.began = joints(json.at("began"));
    if (json.contains("block_delete_changes"))
      entry.program.block_delete_changes = changes_from(json.at("block_delete_changes"));
    if (json.contains("measured_values")) entry.program.measured = measured_from(json.at("measured_values"));
  }
  if (json.contains("q")) entry.program.q = joints(json.at("q"));
  if (entry.kind == Kind::kStands)  // earlier logs have the setpoint alone
    entry.q_measured = json.contains("measured") ? joints(json.at("measured")) : entry.program.q;
  if (entry.kind == Kind::kDrives)
    entry.drives = static_cast<DriveState>(index_of(kDriveNames, json.at("state")));
  if (entry.kind == Kind::kLow) entry.blocks = whole<std::uint32_t>(json.at("blocks"));
  if (entry.kind == Kind::kRatePlans) entry.late = json.at("late");
  if (entry.kind == Kind::kFault) entry.fault = fault_of(json.at("fault"));
  if (entry.kind == Kind::kFault) entry.joint = whole<int>(json.at("joint"));
  if (entry.kind == Kind::kInputs) {
    entry.inputs.digital = whole<std::uint64_t>(json.at("digital"));
    entry.inputs.probe = json.at("probe");
    entry.inputs.spindle_ready = json.at("spindle_ready");
    entry.inputs.spindle_turns = json.at("turns");
  }
  if (entry.kind == Kind::kAnswer) entry.answer = answer_from(json);
  if (entry.kind == Kind::kSensor) entry.sensor = sensor_from(json);
  if (entry.kind == Kind::kFeatures) entry.features = features_from(json.at("features"));
  if (entry.kind == Kind::kHeld)
    entry.held = {whole<std::uint64_t>(json.at("block")), json.at("text").get<std::string>(),
                  json.at("at").get<std::array<double, 6>>()};
  if (entry.kind == Kind::kDeleteTool) entry.tool = whole<int>(json.at("tool"));
  if (entry.kind == Kind::kTakenBack) entry.taken_back = whole<std::uint64_t>(json.at("behind"));
  if (entry.kind == Kind::kGap) {
    entry.since = whole<std::uint64_t>(json.at("since"));
    entry.lost = whole<std::uint64_t>(json.at("lost"));
  }
  if (entry.kind == Kind::kBlockDelete) {
    const std::vector<BlockDeleteChange> changes = changes_from(json.at("changes"));
    if (changes.size() != 1) throw std::runtime_error("one change of the block delete");
    entry.change = changes.front();
  }
  if (entry.kind != Kind::kCommand) return entry;
  entry.command.kind = tick_command_called(json.at("command"));
  entry.command.value = json.at("value");
  entry.command.speed = json.at("speed");
  entry.command.joint = whole<int>(json.at("joint"));
  return entry;
}

}  // namespace

std::string make_log_file(const std::string& path) {
  std::string name = path;
  for (int number = 1; number <= kLogsMax; ++number) {
    const int fd = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0640);
    if (fd >= 0) {
      close(fd);
      return name;
    }
    if (errno != EEXIST)
      throw OutputError(fmt::format("{}: cannot write the session's log: {}", name, std::strerror(errno)));
    name = fmt::format("{}.{}", path, number);
  }
  throw OutputError(fmt::format("{}: {} sessions are kept beside it; move some away", path, kLogsMax));
}

SessionHead session_head(const std::string& machine, const std::string& tools, const std::string& vars,
                         bool run) {
  const auto content = [](const std::string& file) {
    return !file.empty() && std::filesystem::exists(file) ? read_text_file(file) : std::string();
  };
  return {machine, tools, vars, run, content(tools), content(vars)};
}

SessionLog::SessionLog(const std::string& path, const SessionHead& head)
    : file_(path), head_(one_line(to_json(head))) {
  if (file_.put(head_))
    head_.clear();
  else
    begin_gap(0);
}

SessionLog::~SessionLog() {
  if (gap_) end_gap(next_period_);
}

void SessionLog::begin_gap(std::uint64_t period) {
  gap_.emplace();
  gap_->kind = Kind::kGap;
  gap_->since = period;
  next_try_ = std::chrono::steady_clock::now() + kTryAgain;
  trouble_ = fmt::format(
      "{}: {}; what operator and drives do is not recorded until there is room again, and 'replay' ends here",
      file_.path(), file_.why());
}

// The mark, and before it the head where not even that could be written.
bool SessionLog::end_gap(std::uint64_t period) {
  if (!head_.empty() && !file_.put(head_)) return false;
  head_.clear();
  gap_->period = period;
  if (!file_.put(one_line(to_json(*gap_)))) return false;
  gap_.reset();
  return true;
}

std::string SessionLog::take_trouble() {
  const std::lock_guard lock(mutex_);
  return std::exchange(trouble_, "");
}

void SessionLog::program(const ProgramStart& start) {
  SessionEntry entry;
  entry.kind = Kind::kProgram;
  entry.program = start;
  write_now(entry);
}

void SessionLog::block_delete(const BlockDeleteChange& change) {
  SessionEntry entry;
  entry.kind = Kind::kBlockDelete;
  entry.change = change;
  write_now(entry);
}

void SessionLog::held(const HeldLines& lines) {
  SessionEntry entry;
  entry.kind = Kind::kHeld;
  entry.held = lines;
  write_now(entry);
}

void SessionLog::tool_deleted(int number) {
  SessionEntry entry;
  entry.kind = Kind::kDeleteTool;
  entry.tool = number;
  write_now(entry);
}

void SessionLog::taken_back(std::uint64_t block) {
  SessionEntry entry;
  entry.kind = Kind::kTakenBack;
  entry.taken_back = block;
  write_now(entry);
}

void SessionLog::write_now(SessionEntry& entry) {
  const std::lock_guard lock(mutex_);
  entry.period = next_period_;
  write(entry);
}

void SessionLog::posted(const RtCommand& command) {
  const std::lock_guard lock(mutex_);
  open_.push_back(command);
}

void SessionLog::report(const CycleReport& report) {
  const std::lock_guard lock(mutex_);
  SessionEntry entry;
  entry.period = report.period;
  entry.kind = Kind::kCommand;
  while (!open_.empty() && static_cast<std::int32_t>(report.last_command_id - open_.front().id) >= 0) {
    entry.command = open_.front();
    open_.pop_front();
    write(entry);
  }
  entry.kind = Kind::kLow;
  entry.blocks = report.blocks_when_low;
  if (entry.blocks > 0) write(entry);
  entry.kind = Kind::kRatePlans;
  entry.late = report.rate_plan_late;
  if (entry.late != last_.rate_plan_late) write(entry);
  entry.kind = Kind::kStands;
  entry.program.q = report.q_setpoint;
  entry.q_measured = report.q_measured;
  if (report.drives == DriveState::kEnabled && last_.drives != DriveState::kEnabled) write(entry);
  report_drives(report);
  entry.kind = Kind::kFault;
  entry.fault = report.fault;
  entry.joint = report.fault_joint;
  if (report.fault != Fault::kOk && last_.fault == Fault::kOk && report.fault != Fault::kEmergencyStop)
    write(entry);
  report_io(report);
  last_ = report;
  next_period_ = report.period + 1;
}

// How drives that do not obey come up changes nothing: the log has where they stand then. Drives that obeyed
// and are brought up once more, as one that closes its brake again, leave the plan for that time.
void SessionLog::report_drives(const CycleReport& report) {
  const bool obeyed = last_.drives == DriveState::kEnabled;
  const bool up =
      report.drives == DriveState::kEnabled || (report.drives == DriveState::kStarting && !obeyed);
  if (up || report.drives == last_.drives) return;
  SessionEntry entry;
  entry.period = report.period;
  entry.kind = Kind::kDrives;
  entry.drives = report.drives;
  write(entry);
}

void SessionLog::report_io(const CycleReport& report) {
  SessionEntry entry;
  entry.period = report.period;
  entry.kind = Kind::kInputs;
  entry.inputs.digital = report.inputs;
  entry.inputs.probe = report.probe;
  entry.inputs.spindle_ready = report.spindle_ready;
  entry.inputs.spindle_turns = report.spindle_turns;
  const bool turned = report.reads_encoder && report.spindle_turns != last_.spindle_turns;
  if (turned || report.inputs != last_.inputs || report.probe != last_.probe ||
      report.spindle_ready != last_.spindle_ready)
    write(entry);
  entry.kind = Kind::kAnswer;
  entry.answer = report.answer;
  if (report.answered) write(entry);
  entry.kind = Kind::kSensor;
  entry.sensor = report.sensor;
  if (entry.sensor.channel >= 0) write(entry);
}

void SessionLog::features(const std::vector<FeatureDeflection>& features) {
  const std::lock_guard lock(mutex_);
  SessionEntry entry;
  entry.period = last_.period;
  entry.kind = Kind::kFeatures;
  entry.features = features;
  write(entry);
}

void SessionLog::write(const SessionEntry& entry) {
  if (gap_ && std::chrono::steady_clock::now() >= next_try_) {
    next_try_ = std::chrono::steady_clock::now() + kTryAgain;
    end_gap(entry.period);
  }
  if (!gap_ && file_.put(one_line(to_json(entry)))) return;
  if (!gap_) begin_gap(entry.period);
  ++gap_->lost;
}

std::string session_text(const Session& session) {
  std::string text = one_line(to_json(session.head)) + "\n";
  for (const SessionEntry& entry : session.entries) text += one_line(to_json(entry)) + "\n";
  return text;
}

Session parse_session(std::string_view text, const std::string& name) {
  std::istringstream in{std::string(text)};
  Session session;
  std::string row;
  for (int line = 1; std::getline(in, row); ++line) {
    const bool cut_off =
        line > 1 && in.eof() && !Json::accept(row);  // whoever wrote it had no time for its end
    if (cut_off) {
      session.torn_line = line;
      break;
    }
    try {
      const Json json = Json::parse(row);
      if (line == 1)
        session.head = {json.at("machine"),
                        json.at("tools"),
                        json.at("vars"),
                        json.value("run", false),
                        json.value("tools_text", ""),
                        json.value("vars_text", "")};
      else
        session.entries.push_back(from_json(json));
    } catch (const std::exception& error) {
      throw ProgramError(fmt::format("{}:{}: not a line of a session's log: {}", name, line, error.what()));
    }
  }
  if (session.head.machine.empty()) throw ProgramError(fmt::format("{}:1: the log's head is missing", name));
  return session;
}

Session read_session(const std::string& path) {
  try {
    return parse_session(read_named_file(path), path);
  } catch (const PlainFileError& error) {
    throw ProgramError(error.what());
  }
}

}  // namespace trn

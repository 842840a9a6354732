#include "panel/server/panel_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <iterator>
#include <memory>
#include <utility>

#include "app/client/command_rights.h"
#include "app/client/command_table.h"
#include "app/client/daemon_line.h"
#include "app/client/message_json.h"
#include "app/client/remote_line.h"
#include "core/axes.h"
#include "panel/server/machine_json.h"
#include "panel/server/program_folder.h"

namespace trn {

namespace {

using nlohmann::json;
using trunnion::command_t;
using namespace std::chrono_literals;

constexpr auto kStatusEvery = 100ms, kMotionEvery = 50ms, kDeadMan = 500ms, kLost = 3000ms;
constexpr auto kStandstill = 1000ms, kOldMessages = 500ms;
constexpr int kMalformedMax = 3;
constexpr std::size_t kHistoryMax = 1000, kPressesMax = 4096, kNotedMax = 80;

std::string text_of(const json& message) {
  return message.dump(-1, ' ', false, json::error_handler_t::replace);
}

bool begins_program(const command_t& command) {
  return command.verb == command_t::START || command.verb == command_t::RESUME ||
         command.verb == command_t::MDI || command.verb == command_t::HOME;
}

bool begins_motion(const command_t& command) {
  return begins_program(command) || (command.verb == command_t::JOG && command.value != 0);
}

// A jog of one joint has a state of its own; one along a direction runs as a program of this name. One that
// leads away from a held program is a detour of it.
bool jogs_now(const trunnion::status_t& status) {
  const bool runs = status.state == "running" || status.state == "holding" || status.state == "stopping";
  return status.state == "jogging" || status.detour == "jogs" || status.detour == "retraces" ||
         (runs && status.program == "jog");
}

bool is_file(const std::string& program) { return program.starts_with('/'); }

// The daemon stops what this jog moves, and nothing else: it refuses it while a program runs.
command_t stop_of(command_t jog) {
  jog.value = jog.speed = jog.speed_share = 0;
  jog.alive_ms = 0;
  return jog;
}

std::int64_t now_us() {
  const auto wall = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(wall).count();
}

std::unique_ptr<DaemonLine> line_to(const PanelConfig& config) {
  if (config.remote)
    return std::make_unique<RemoteLine>(config.lcm, config.remote->group, config.remote->key_file);
  return std::make_unique<SocketLine>(config.lcm, config.access, 0.0);
}

json gone_json(bool remote) {
  return {
      {"type", "gone"},
      {"text", remote ? "No status of this machine comes over the network: does its daemon run there, and "
                        "does its LCM group reach this computer?"
                      : "No daemon answers for this machine."}};
}

json typed(const char* type, json message) {
  message["type"] = type;
  return message;
}

}  // namespace

PanelState::PanelState(const PanelConfig& config)
    : config_(config),
      daemon_([&config] { return line_to(config); }),
      plan_(config),
      fleet_(config.lcm.url, config.pages_of_others) {
  daemon_.on_status = [this] { heard_status(); };
  daemon_.on_motion = [this] {
    for (auto& [id, page] : pages_) page.motion = true;
  };
  daemon_.on_tables = [this] {
    for (auto& [id, page] : pages_) page.tables = true;
    plan_due_ = true;
  };
  daemon_.on_scope_signals = [this](const auto& list) { hear_scope_signals(list); };
  daemon_.on_scope_data = [this](const auto& data) { hear_scope_data(data); };
  daemon_.on_alarms = [this] {
    for (auto& [id, page] : pages_) page.alarms = true;
  };
}

// A process that was stopped finds what pages said long ago, and may read it before anything else.
void PanelState::notice_standstill() {
  const auto now = Clock::now();
  if (now - looked_ > kStandstill) old_until_ = now + kOldMessages;
  looked_ = now;
  watch_jogs();
}

void PanelState::step() {
  notice_standstill();
  daemon_.step();
  stop_jogs();
  watch_holder();
  watch_plan();
  if (fleet_.step(Clock::now())) tell_all(fleet_json());
  if (daemon_.connected()) {
    told_gone_ = false;
    return;
  }
  if (std::exchange(told_gone_, true)) return;
  // What was heard last and not yet sent would come behind this, and look like the daemon's return.
  for (auto& [id, page] : pages_) page.status = page.motion = page.tables = page.alarms = false;
  tell_all(gone_json(config_.remote.has_value()));
}

bool PanelState::open(PageId id, const Visitor& visitor) {
  if (pages_.size() >= kPagesMax) return false;
  Page& page = pages_[id];
  page.visitor = visitor;
  if (config_.remote) page.visitor.role = std::min(visitor.role, config_.remote->role);
  page.heard = Clock::now();
  page.status = !told_gone_ && daemon_.status().has_value();
  page.motion = !told_gone_ && daemon_.motion().has_value();
  page.tables = !told_gone_ && daemon_.tables().has_value();
  page.alarms = !told_gone_ && daemon_.alarms().has_value();
  plan_due_ = true;
  put(page, {{"type", "hello"},
             {"version", config_.version},
             {"machine", config_.machine.name},
             {"clock_us", daemon_.status() ? daemon_.status()->clock_us : 0},
             {"server_time_us", now_us()}});
  put(page, controls_of(id));
  put(page, typed("plan", plan_.state()));
  put(page, fleet_json());
  if (told_gone_) put(page, gone_json(config_.remote.has_value()));
  return true;
}

void PanelState::close(PageId id) {
  const auto found = pages_.find(id);
  if (found == pages_.end()) return;
  found->second.gone = found->second.stop_wanted = true;
  found->second.events.clear();
  found->second.held.reset();
  if (controls_.holder() == id) lose(found->second);
  if (!found->second.jogs()) pages_.erase(found);
  if (controls_.holder() != id && controls_.asker() != id) return;
  controls_.gone(id);
  tell_controls();
}

bool PanelState::receive(PageId id, std::string_view text) {
  const auto found = pages_.find(id);
  if (found == pages_.end() || found->second.gone) return false;
  notice_standstill();
  Page& page = found->second;
  PageMessage message;
  try {
    message = read_page_message(text);
  } catch (const BadPageMessage& bad) {
    put(page, {{"type", "error"}, {"text", bad.what()}});
    return ++page.malformed < kMalformedMax;
  }
  if (message.kind == PageMessage::Kind::kAlive) hear_alive(id, page);
  if (message.kind == PageMessage::Kind::kHoldWhenLost) {
    page.hold_when_lost = message.hold_when_lost;
    if (!page.jogs()) page.heard = Clock::now();
  }
  if (message.kind == PageMessage::Kind::kTakeControls) want_controls(id);
  answer_controls(id, message.kind);
  if (message.kind == PageMessage::Kind::kScope) ask_scope(id, message);
  if (message.kind == PageMessage::Kind::kCommand) command(id, message);
  return true;
}

std::string PanelState::name_of(PageId id) const {
  const auto found = pages_.find(id);
  const bool named = found != pages_.end() && !found->second.visitor.name.empty();
  return named ? found->second.visitor.name : fmt::format("page {}", id);
}

// Who had the controls may still jog.
void PanelState::holder_was(PageId id) {
  const auto before = pages_.find(id);
  if (before == pages_.end()) return;
  before->second.stop_wanted = before->second.jogs();
  before->second.held.reset();
}

void PanelState::want_controls(PageId id) {
  Page& page = pages_.at(id);
  const auto say = [&](const std::string& text) {
    put(page, {{"type", "message"}, {"time_us", now_us()}, {"kind", "refused"}, {"text", text}});
  };
  if (page.visitor.role < Role::kOperate) return say("Your role is to look, not to operate.");
  const PageId before = controls_.holder();
  const Controls::Answer answer = controls_.want(id, Clock::now());
  if (answer == Controls::Answer::kAnotherAsks)
    return say(fmt::format("{} asks for the controls already.", name_of(controls_.asker())));
  if (!page.jogs()) page.heard = Clock::now();
  if (controls_.holder() == id && before != id) {
    holder_was(before);
    note("controls", fmt::format("{} has the controls.", name_of(id)));
  }
  tell_controls();
}

void PanelState::answer_controls(PageId id, PageMessage::Kind kind) {
  const PageId asker = controls_.asker();
  if (kind == PageMessage::Kind::kGiveControls && controls_.give(id)) {
    holder_was(id);
    const PageId now = controls_.holder();
    if (const auto page = pages_.find(now); page != pages_.end()) page->second.heard = Clock::now();
    note("controls", now == 0 ? fmt::format("{} has given up the controls.", name_of(id))
                              : fmt::format("{} has given the controls to {}.", name_of(id), name_of(now)));
    tell_controls();
  }
  if (kind == PageMessage::Kind::kKeepControls && controls_.keep(id)) {
    note("controls", fmt::format("{} keeps the controls; {} asked.", name_of(id), name_of(asker)));
    tell_controls();
  }
}

// Who did what: where pages log in, the daemon knows the panel's user only.
void PanelState::note_command(const Page& page, const PageMessage& message) {
  const command_t& command = message.command;
  const bool end_of_jog = command.verb == command_t::JOG && command.value == 0;
  if (page.visitor.name.empty() || end_of_jog) return;
  std::string what(find_command(command.verb)->name);
  if (!command.text.empty()) what += " " + command.text.substr(0, kNotedMax);
  note("did", fmt::format("{}: {}", page.visitor.name, what));
}

void PanelState::command(PageId id, const PageMessage& message) {
  Page& page = pages_.at(id);
  command_t command = message.command;
  const bool always =
      command.verb == command_t::ESTOP || command.verb == command_t::STOP || command.verb == command_t::HOLD;
  if (role_for(command) > page.visitor.role)
    return refuse(page, message.id,
                  fmt::format("your role is '{}', and this needs '{}'", to_string(page.visitor.role),
                              to_string(role_for(command))));
  if (!always && controls_.holder() != id)
    return refuse(page, message.id, "this page only looks; take the controls first");
  if (begins_motion(command) && Clock::now() < old_until_)
    return refuse(page, message.id, "the panel stood still for a while, and this may be old; ask again");
  note_command(page, message);
  if (command.verb == command_t::JOG) return jog(id, message);
  if (begins_program(command) && somebody_jogs())
    return refuse(page, message.id, "a move by hand goes on; wait until it has ended");
  if (command.verb == command_t::LOAD && config_.remote && !command.text.empty() && !is_file(command.text))
    return refuse(page, message.id,
                  "the programs of this machine lie on its own computer: give the whole path there, as "
                  "/var/lib/trunnion/programs/part.ngc");
  if (command.verb == command_t::LOAD && !config_.remote && !command.text.empty()) {
    try {
      command.text = program_path(config_.programs_folder, command.text);
    } catch (const NoProgram& none) {
      return refuse(page, message.id, none.what());
    }
  }
  forward(id, message, command);
}

// A press that comes a second time, however that happened, moves nothing.
void PanelState::jog(PageId id, const PageMessage& message) {
  Page& page = pages_.at(id);
  const command_t& jog = message.command;
  if (jog.value != 0 && !is_new(message.press))
    return refuse(page, message.id, "this press was obeyed before");
  page.held.reset();
  if (jog.value != 0) {
    // While it jogs a new press is no sign that somebody still holds the old one.
    if (!page.jogs()) page.heard = Clock::now();
    page.last_jog = jog;
    if (jog.alive_ms > 0) page.held = jog;
  }
  ++page.jogs_asked;
  forward(id, message, jog);
}

// The daemon ends a held jog by itself when it is not said again in time. Only one is asked at a time: a jog
// along a direction is planned first, and a second one meanwhile would be another.
void PanelState::hear_alive(PageId id, Page& page) {
  page.heard = Clock::now();
  page.lost = false;
  if (!page.held || page.jogs_asked > 0) return;
  ++page.jogs_asked;
  daemon_.send(*page.held, [this, id](const auto& outcome, const auto& answer) {
    answered(id, nullptr, true, outcome, answer);
  });
}

bool PanelState::is_new(std::int64_t press) {
  if (!presses_.insert(press).second) return false;
  oldest_presses_.push_back(press);
  if (oldest_presses_.size() > kPressesMax) {
    presses_.erase(oldest_presses_.front());
    oldest_presses_.pop_front();
  }
  return true;
}

void PanelState::forward(PageId id, const PageMessage& message, const command_t& command) {
  const bool jog = command.verb == command_t::JOG;
  daemon_.send(command, [this, id, number = message.id, jog](const auto& outcome, const auto& answer) {
    answered(id, number, jog, outcome, answer);
  });
}

void PanelState::refuse(Page& page, const json& number, const std::string& why) {
  put(page, {{"type", "answer"}, {"id", number}, {"outcome", "refused"}, {"text", why}, {"status_count", 0}});
}

bool PanelState::somebody_jogs() const {
  return std::any_of(pages_.begin(), pages_.end(), [](const auto& one) { return one.second.jogs(); });
}

void PanelState::answered(PageId id, const json& number, bool jog, const std::string& outcome,
                          const trunnion::acknowledge_t& answer) {
  const auto found = pages_.find(id);
  if (found == pages_.end()) return;
  Page& page = found->second;
  if (jog) --page.jogs_asked;
  if (jog && outcome == "accepted") page.jog_status = answer.status_count;
  if (jog && outcome == "unreachable") {
    // It may move all the same, and nobody waits for its end.
    page.jog_status = daemon_.status() ? daemon_.status()->count + 1 : -1;
    page.stop_wanted = true;
  }
  if (jog && outcome != "accepted" && page.held) {
    page.held.reset();
    // Nobody waits for the answer to a sign of life.
    if (number.is_null() && !answer.message.empty())
      put(page, {{"type", "message"}, {"time_us", now_us()}, {"kind", outcome}, {"text", answer.message}});
  }
  if (number.is_null()) return;
  put(page, {{"type", "answer"},
             {"id", number},
             {"outcome", outcome},
             {"text", answer.message},
             {"status_count", answer.status_count}});
}

void PanelState::stop_jogs() {
  for (auto page = pages_.begin(); page != pages_.end();) {
    Page& one = page->second;
    if (one.stop_wanted && one.jogs() && daemon_.connected())
      daemon_.send(stop_of(one.last_jog), [](const auto&, const auto&) {});
    if (daemon_.connected() || !one.jogs()) one.stop_wanted = false;
    page = one.gone && !one.jogs() ? pages_.erase(page) : std::next(page);
  }
}

void PanelState::watch_jogs() {
  for (auto& [id, page] : pages_) {
    const auto patience = page.held ? std::chrono::milliseconds(page.held->alive_ms) : kDeadMan;
    // Of a held jog the daemon counts, too, and may have ended it before.
    if ((!page.jogs() && !page.held) || Clock::now() - page.heard < patience) continue;
    page.heard = Clock::now();  // the next stop, if the jog goes on, in another half second
    page.stop_wanted = page.jogs();
    page.held.reset();
    if (page.gone) continue;
    put(page, {{"type", "message"},
               {"time_us", now_us()},
               {"kind", "dead_man"},
               {"text", "The jog was stopped: the page no longer says that somebody holds the button."}});
  }
}

// A page whose computer sleeps keeps its connection for a while.
void PanelState::watch_holder() {
  if (controls_.step(Clock::now())) tell_controls();
  const auto found = pages_.find(controls_.holder());
  if (found == pages_.end() || Clock::now() - found->second.heard < kLost) return;
  lose(found->second);
}

// A program that runs may change offsets and tools, which change nothing of its plan.
void PanelState::watch_plan() {
  const bool may =
      !config_.remote && daemon_.connected() && daemon_.tables() && !pages_.empty() && is_file(loaded_);
  if (may && plan_due_ && (daemon_.status()->state == "idle" || plan_.program() != loaded_)) {
    plan_due_ = false;
    plan_.want(loaded_, *daemon_.status(), *daemon_.tables());
  }
  if (plan_.step()) tell_all(typed("plan", plan_.state()));
}

void PanelState::lose(Page& page) {
  if (!page.hold_when_lost || std::exchange(page.lost, true)) return;
  if (!daemon_.connected() || daemon_.status()->state != "running") return;
  command_t command{};
  command.verb = command_t::HOLD;
  daemon_.send(command, [](const auto&, const auto&) {});
  note("dead_man", "The program holds: the page that had the controls was lost.");
}

void PanelState::note(const char* kind, const std::string& text) {
  json entry{{"time_us", now_us()}, {"kind", kind}, {"text", text}};
  if (history_.size() >= kHistoryMax) history_.pop_front();
  history_.push_back(entry);
  tell_all(typed("message", std::move(entry)));
}

void PanelState::heard_status() {
  const trunnion::status_t& status = *daemon_.status();
  const bool another = std::exchange(daemon_pid_, status.pid) != status.pid;  // its counts begin anew
  for (auto& [id, page] : pages_) {
    page.status = true;
    const bool ended = status.count >= page.jog_status && !jogs_now(status);
    if (another || ended) page.jog_status = -1;
  }
  if (is_file(status.program)) loaded_ = status.program;
  if (std::exchange(last_state_, status.state) != status.state) plan_due_ = true;
  if (std::exchange(last_fault_, status.fault) != status.fault && status.fault != "ok")
    note("fault", status.fault);
  if (std::exchange(last_message_, status.message) != status.message && !status.message.empty())
    note("message", status.message);
}

void PanelState::put(Page& page, const json& message) {
  if (page.gone) return;
  if (page.events.size() >= kEventsMax)
    page.overflown = true;
  else
    page.events.push_back(text_of(message));
}

void PanelState::tell_all(const json& message) {
  for (auto& [id, page] : pages_) put(page, message);
}

void PanelState::tell_controls() {
  for (auto& [id, page] : pages_) put(page, controls_of(id));
}

json PanelState::controls_of(PageId id) const {
  const PageId holder = controls_.holder(), asker = controls_.asker();
  return {{"type", "controls"},
          {"page", id},
          {"mine", id == holder},
          {"holder", holder},
          {"holder_name", holder == 0 ? "" : name_of(holder)},
          {"asker", asker},
          {"asker_name", asker == 0 ? "" : name_of(asker)},
          {"may_take", controls_.may_take(Clock::now())}};
}

bool PanelState::waiting(PageId id) const {
  const auto found = pages_.find(id);
  if (found == pages_.end()) return false;
  const Page& page = found->second;
  const auto now = Clock::now();
  return !page.events.empty() || page.tables || page.alarms ||
         (page.status && now - page.status_sent >= kStatusEvery) ||
         (page.motion && now - page.motion_sent >= kMotionEvery);
}

bool PanelState::overflown(PageId id) const {
  const auto found = pages_.find(id);
  return found != pages_.end() && found->second.overflown;
}

// The state is written when the page takes it, so that what waits is always the newest.
std::optional<std::string> PanelState::next(PageId id) {
  if (!waiting(id)) return std::nullopt;
  Page& page = pages_.at(id);
  if (!page.events.empty()) {
    std::string text = std::move(page.events.front());
    page.events.pop_front();
    return text;
  }
  const auto now = Clock::now();
  if (page.status && now - page.status_sent >= kStatusEvery) {
    page.status = false;
    page.status_sent = now;
    return text_of(typed("status", json_of(*daemon_.status())));
  }
  if (page.tables) {
    page.tables = false;
    return text_of(typed("tables", json_of(*daemon_.tables())));
  }
  if (page.alarms) {
    page.alarms = false;
    return text_of(typed("alarms", json_of(*daemon_.alarms())));
  }
  page.motion = false;
  page.motion_sent = now;
  return text_of(typed("motion", json_of(*daemon_.motion())));
}

std::optional<std::string> PanelState::get(std::string_view name) const {
  if (name == "machine")
    return text_of(machine_json(config_.machine, config_.version, config_.config_path,
                                daemon_.status() ? daemon_.status()->axes : "", config_.kinematics,
                                config_.drawings, config_.remote));
  if (name == "state") return text_of(state_json());
  if (name == "history") return text_of(json(history_));
  if (name == "programs") return text_of(programs_json());
  return std::nullopt;
}

void PanelState::keep(const std::string& name, const std::string& text) {
  if (config_.remote)
    throw NoProgram(
        "the machine is on another computer, and so are its programs: copy this one there, into the folder "
        "that its daemon reads");
  const bool rests = !daemon_.connected() || daemon_.status()->state == "idle";
  if (!rests && std::filesystem::path(loaded_).filename() == name)
    throw NoProgram("this program is at work; send it when the machine is idle");
  keep_program(config_.programs_folder, name, text);
  plan_due_ = true;
}

std::optional<OpenFile> PanelState::program_text(std::string_view name) const {
  constexpr std::string_view kOfFolder = "programs/";
  if (config_.remote) return std::nullopt;  // a file of that name here may be another
  if (name == "program") return loaded_.empty() ? std::nullopt : open_file(loaded_);
  if (!name.starts_with(kOfFolder)) return std::nullopt;
  try {
    return open_file(program_path(config_.programs_folder, std::string(name.substr(kOfFolder.size()))));
  } catch (const NoProgram&) {
    return std::nullopt;
  }
}

std::optional<OpenFile> PanelState::drawing(std::string_view name) const {
  constexpr std::string_view kOfMachine = "drawings/";
  std::size_t number = 0;
  if (!name.starts_with(kOfMachine)) return std::nullopt;
  const std::string_view digits = name.substr(kOfMachine.size());
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  const bool known =
      error == std::errc() && end == digits.data() + digits.size() && number < config_.drawings.size();
  return known ? open_file(config_.drawings[number].file) : std::nullopt;
}

json PanelState::programs_json() const {
  json programs = json::array();
  if (config_.remote) return programs;
  for (const ProgramFile& file : list_programs(config_.programs_folder))
    programs.push_back({{"name", file.name}, {"size", file.size}, {"modified_s", file.modified_s}});
  return programs;
}

json PanelState::fleet_json() const {
  return {{"type", "fleet"}, {"machines", fleet_.machines(Clock::now())}, {"silent", fleet_.silent()}};
}

json PanelState::state_json() const {
  json out{{"connected", daemon_.connected()}, {"age_s", daemon_.age_s()}};
  out["status"] = daemon_.status() ? json_of(*daemon_.status()) : json();
  out["motion"] = daemon_.motion() ? json_of(*daemon_.motion()) : json();
  out["tables"] = daemon_.tables() ? json_of(*daemon_.tables()) : json();
  out["alarms"] = daemon_.alarms() ? json_of(*daemon_.alarms()) : json();
  return out;
}

}  // namespace trn

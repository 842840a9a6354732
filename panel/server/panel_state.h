#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "panel/server/controls.h"
#include "panel/server/daemon_watch.h"
#include "panel/server/fleet.h"
#include "panel/server/log_in.h"
#include "panel/server/metrics.h"
#include "panel/server/page_folder.h"
#include "panel/server/page_message.h"
#include "panel/server/panel_config.h"
#include "panel/server/plan_maker.h"

namespace trn {

/// What the panel knows and decides, without its sockets: pages, who has the controls, and what each page is
/// to be told next. A page that does not read keeps at most `kEventsMax` texts and the newest state waiting.
class PanelState {
 public:
  static constexpr std::size_t kPagesMax = 100, kEventsMax = 256;

  explicit PanelState(const PanelConfig& config);

  /// To be called some hundred times a second.
  void step();

  /// False if there are too many.
  bool open(PageId page, const Visitor& visitor);
  void close(PageId page);
  /// False if the page is to be closed, after too many malformed messages.
  bool receive(PageId page, std::string_view text);
  /// The next text for the page; nothing if there is none now.
  std::optional<std::string> next(PageId page);
  /// True if `next` has something.
  bool waiting(PageId page) const;
  /// True if the page read so little that it is to be closed.
  bool overflown(PageId page) const;

  /// The answer to GET /api/v1/NAME, nothing if there is no such thing.
  std::optional<std::string> get(std::string_view name) const;
  /// The answer to GET /metrics.
  std::string metrics() const { return metrics_text(config_, daemon_, pages_.size()); }
  /// Keeps a program that a page sends. NoProgram where it may not; also where the daemon runs that one.
  void keep(const std::string& name, const std::string& text);
  /// The plan of the loaded program that GET /api/v1/plan answers; nothing if there is none.
  std::optional<OpenFile> plan() const { return plan_.file(); }
  /// A drawing of the machine by "drawings/" and its place in the list of the machine.
  std::optional<OpenFile> drawing(std::string_view name) const;
  /// The text that GET /api/v1/program or programs/NAME answers: of the program that the daemon has loaded,
  /// wherever it lies, or of one in the folder; nothing if there is no such program.
  std::optional<OpenFile> program_text(std::string_view name) const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Page {
    Visitor visitor;
    std::deque<std::string> events;
    bool status = false, motion = false, tables = false, alarms = false;  ///< news that the page has not had
    Clock::time_point status_sent, motion_sent, heard;
    int malformed = 0;
    bool overflown = false;
    bool gone = false;         ///< kept until its jogs have ended
    bool stop_wanted = false;  ///< of its jogs
    bool hold_when_lost = false, lost = false;
    trunnion::command_t last_jog{};
    std::optional<trunnion::command_t> held;  ///< the jog that is said again while the page says it lives
    int jogs_asked = 0;                       ///< not answered yet
    std::int64_t jog_status =
        -1;  ///< count of the first status after the last accepted jog; -1: none goes on
    bool jogs() const { return jogs_asked > 0 || jog_status >= 0; }
  };

  /// True for each press once.
  bool is_new(std::int64_t press);
  void refuse(Page& page, const nlohmann::json& number, const std::string& why);
  bool somebody_jogs() const;
  static void put(Page& page, const nlohmann::json& message);
  void tell_all(const nlohmann::json& message);
  void note(const char* kind, const std::string& text);
  void tell_controls();
  nlohmann::json controls_of(PageId id) const;
  nlohmann::json fleet_json() const;
  void ask_scope(PageId id, const PageMessage& message);
  /// The page whose question this answers, with its `id`; null where it has gone.
  Page* scope_page(std::int32_t sequence, nlohmann::json& id);
  void hear_scope_signals(const trunnion::scope_signals_t& list);
  void hear_scope_data(const trunnion::scope_data_t& data);
  std::string name_of(PageId id) const;
  void want_controls(PageId id);
  void answer_controls(PageId id, PageMessage::Kind kind);
  void holder_was(PageId id);
  void note_command(const Page& page, const PageMessage& message);
  void heard_status();
  void command(PageId id, const PageMessage& message);
  void jog(PageId id, const PageMessage& message);
  void hear_alive(PageId id, Page& page);
  void forward(PageId id, const PageMessage& message, const trunnion::command_t& command);
  void answered(PageId id, const nlohmann::json& number, bool jog, const std::string& outcome,
                const trunnion::acknowledge_t& answer);
  void stop_jogs();
  void watch_jogs();
  void notice_standstill();
  void watch_holder();
  void watch_plan();
  void lose(Page& page);
  nlohmann::json programs_json() const;
  nlohmann::json state_json() const;

  const PanelConfig& config_;
  DaemonWatch daemon_;
  PlanMaker plan_;
  std::map<PageId, Page> pages_;
  Controls controls_;
  Fleet fleet_;
  std::set<std::int64_t> presses_;
  std::deque<std::int64_t> oldest_presses_;
  std::map<std::int32_t, std::pair<PageId, nlohmann::json>> scopes_;  ///< questions to the scope, by sequence
  bool told_gone_ = false;
  Clock::time_point looked_ = Clock::now(),
                    old_until_;  ///< when the server last did anything; behind a standstill
  std::int32_t daemon_pid_ = 0;
  std::string last_message_, last_fault_ = "ok";
  std::string loaded_;  ///< path of the program that was loaded last
  std::string last_state_;
  bool plan_due_ = false;  ///< something is new that its plan may depend on
  std::deque<nlohmann::json> history_;
};

}  // namespace trn

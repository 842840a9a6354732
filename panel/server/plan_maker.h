#pragma once

#include <sys/types.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "hal/lcm_messages.h"
#include "panel/server/page_folder.h"
#include "panel/server/panel_config.h"

namespace trn {

/// Has the loaded program planned by a process of its own, with the offsets and tools of the machine, so that
/// pages show it before it runs. One process at a time; one that is no longer wanted is killed.
class PlanMaker {
 public:
  /// std::runtime_error where there is no room for its files.
  explicit PlanMaker(const PanelConfig& config);
  ~PlanMaker();
  PlanMaker(const PlanMaker&) = delete;
  PlanMaker& operator=(const PlanMaker&) = delete;

  /// The program whose plan is wanted, a real path, as the machine stands now. Begins anew where the file,
  /// an offset or a tool is another than before.
  void want(const std::string& program, const trunnion::status_t& status, const trunnion::tables_t& tables);
  /// To be called some times a second. True if `state` has changed.
  bool step();
  const std::string& program() const { return program_; }
  /// For pages: "state" none, working, ready or failed; "program"; "text", why there is none or not all of
  /// it; "number" of the plan.
  nlohmann::json state() const;
  /// The plan, as docs/panel.md describes it.
  std::optional<OpenFile> file() const;

 private:
  enum class State { kNone, kWorking, kReady, kFailed };

  void begin(const std::string& program, const trunnion::status_t& status, const trunnion::tables_t& tables);
  void end_process();
  std::string path(const std::string& name) const { return folder_ + "/" + name; }
  std::string plan_file(std::int64_t number) const;

  const PanelConfig& config_;
  std::string folder_;
  std::string wanted_, program_, text_;
  State state_ = State::kNone;
  std::int64_t number_ = 0;
  pid_t process_ = -1;
  bool changed_ = false;
};

}  // namespace trn

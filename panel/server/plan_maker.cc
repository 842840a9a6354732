#include "panel/server/plan_maker.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "core/units.h"

namespace trn {

namespace {

using trunnion::status_t;
using trunnion::tables_t;

constexpr const char *kTools = "tools.tbl", *kOffsets = "offsets.var", *kErrors = "errors.txt";
constexpr std::array<const char*, 4> kStates{"none", "working", "ready", "failed"};
constexpr int kPlanned = 0,
              kPlannedInPart = 2;  // of 'trunnion run': the plan goes as far as the program is good
constexpr int kStandardFiles = 3;

// The numbered parameter that holds an offset's X; its other words follow.
struct OffsetPlace {
  const char* name;
  int number;
  int system = 0;  ///< of a coordinate system: 1 to 9
};
constexpr std::array<OffsetPlace, 12> kOffsetPlaces{{{"G54", 5221, 1},
                                                     {"G55", 5241, 2},
                                                     {"G56", 5261, 3},
                                                     {"G57", 5281, 4},
                                                     {"G58", 5301, 5},
                                                     {"G59", 5321, 6},
                                                     {"G59.1", 5341, 7},
                                                     {"G59.2", 5361, 8},
                                                     {"G59.3", 5381, 9},
                                                     {"G92", 5211},
                                                     {"G28", 5161},
                                                     {"G30", 5181}}};

// As in a .var file, where the numbers rise: mm and degrees.
std::string offsets_text(const tables_t& tables, const std::string& in_force) {
  constexpr int kRotation = 9, kSystem = 5220, kShifted = 5210;
  std::map<int, double> values;
  for (std::size_t i = 0; i < static_cast<std::size_t>(tables.offset_count); ++i) {
    const auto* const place =
        std::find_if(kOffsetPlaces.begin(), kOffsetPlaces.end(),
                     [&](const OffsetPlace& one) { return one.name == tables.offset_name[i]; });
    if (place == kOffsetPlaces.end()) continue;
    const std::array<double, 6> words{tables.offset_x[i],
                                      tables.offset_y[i],
                                      tables.offset_z[i],
                                      kDegPerRad * tables.offset_a[i],
                                      kDegPerRad * tables.offset_b[i],
                                      kDegPerRad * tables.offset_c[i]};
    for (std::size_t word = 0; word < words.size(); ++word)
      values[place->number + static_cast<int>(word)] = words[word];
    if (place->system > 0) values[place->number + kRotation] = kDegPerRad * tables.offset_rotation[i];
    if (place->system > 0 && place->name == in_force) values[kSystem] = place->system;
    const bool shifts = std::any_of(words.begin(), words.end(), [](double value) { return value != 0; });
    if (std::string_view(place->name) == "G92") values[kShifted] = shifts ? 1 : 0;
  }
  std::string out;
  for (const auto& [number, value] : values) out += fmt::format("{}\t{:.9f}\n", number, value);
  return out;
}

std::string tools_text(const tables_t& tables) {
  std::string out;
  for (int i = 0; i < tables.tool_count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    out += fmt::format("T{} P{} X{:.9f} Y{:.9f} Z{:.9f} A{:.9f} B{:.9f} C{:.9f} D{:.9f} ;{}\n",
                       tables.tool_number[k], tables.tool_pocket[k], tables.tool_x[k], tables.tool_y[k],
                       tables.tool_z[k], kDegPerRad * tables.tool_a[k], kDegPerRad * tables.tool_b[k],
                       kDegPerRad * tables.tool_c[k], tables.tool_diameter[k], tables.tool_remark[k]);
  }
  return out;
}

void write_file(const std::string& path, const std::string& text) { std::ofstream(path) << text; }

// The last line of what the process said.
std::string last_line(const std::string& path) {
  std::ifstream in(path);
  std::string line, last;
  while (std::getline(in, line))
    if (!line.empty()) last = line;
  return last;
}

std::string file_version(const std::string& path) {
  struct stat info {};
  if (stat(path.c_str(), &info) != 0) return "";
  return fmt::format("{} {} {}.{}", path, info.st_size, info.st_mtim.tv_sec, info.st_mtim.tv_nsec);
}

// -1: it could not be started.
pid_t start_process(const std::vector<std::string>& words, const std::string& errors) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, 1, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&files, 2, errors.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                   S_IRUSR | S_IWUSR);
  // Neither the pages' connections nor the daemon's.
  posix_spawn_file_actions_addclosefrom_np(&files, kStandardFiles);
  pid_t process = -1;
  const int failed = posix_spawn(&process, arguments[0], &files, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  return failed ? -1 : process;
}

}  // namespace

PlanMaker::PlanMaker(const PanelConfig& config) : config_(config) {
  folder_ = (std::filesystem::temp_directory_path() / "trunnion-panel-XXXXXX").string();
  if (!mkdtemp(folder_.data())) throw std::runtime_error(fmt::format("cannot make a folder {}", folder_));
}

PlanMaker::~PlanMaker() {
  end_process();
  std::error_code none;
  std::filesystem::remove_all(folder_, none);
}

void PlanMaker::want(const std::string& program, const status_t& status, const tables_t& tables) {
  const std::string wanted = file_version(program) + status.work_offset + (status.optional_stop ? "1" : "0") +
                             (status.block_delete ? "1" : "0") + offsets_text(tables, status.work_offset) +
                             tools_text(tables);
  if (wanted == wanted_) return;
  wanted_ = wanted;
  begin(program, status, tables);
}

void PlanMaker::begin(const std::string& program, const status_t& status, const tables_t& tables) {
  end_process();
  std::error_code none;
  std::filesystem::remove(plan_file(number_), none);
  program_ = program;
  text_.clear();
  ++number_;
  changed_ = true;
  write_file(path(kOffsets), offsets_text(tables, status.work_offset));
  write_file(path(kTools), tools_text(tables));
  process_ = start_process({config_.own_program, "run", program, "--machine", config_.config_path, "--tools",
                            path(kTools), "--vars", path(kOffsets), "--preview", plan_file(number_)},
                           path(kErrors));
  state_ = process_ > 0 ? State::kWorking : State::kFailed;
  if (process_ <= 0) text_ = "The process that plans could not be started.";
}

void PlanMaker::end_process() {
  if (process_ <= 0) return;
  kill(process_, SIGKILL);
  waitpid(process_, nullptr, 0);
  process_ = -1;
}

bool PlanMaker::step() {
  int how = 0;
  if (process_ > 0 && waitpid(process_, &how, WNOHANG) == process_) {
    process_ = -1;
    const int code = WIFEXITED(how) ? WEXITSTATUS(how) : -1;
    state_ = code == kPlanned || code == kPlannedInPart ? State::kReady : State::kFailed;
    if (code != kPlanned) text_ = last_line(path(kErrors));
    if (state_ == State::kReady && !file()) state_ = State::kFailed;
    if (state_ == State::kFailed && text_.empty())
      text_ = "The plan asked for more time or memory than it may have.";
    changed_ = true;
  }
  return std::exchange(changed_, false);
}

nlohmann::json PlanMaker::state() const {
  return {{"state", kStates[static_cast<std::size_t>(state_)]},
          {"program", program_},
          {"text", text_},
          {"number", number_}};
}

std::string PlanMaker::plan_file(std::int64_t number) const { return path(fmt::format("plan{}", number)); }

std::optional<OpenFile> PlanMaker::file() const {
  if (state_ != State::kReady) return std::nullopt;
  return PageFolder(folder_).open(fmt::format("plan{}", number_));
}

}  // namespace trn

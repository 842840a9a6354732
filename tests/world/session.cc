#include "tests/world/session.h"

#include <fmt/format.h>
#include <signal.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <memory_resource>
#include <thread>

#include "app/daemon/daemon.h"
#include "app/daemon/door.h"
#include "app/daemon/place_keeper.h"
#include "app/daemon/planner_thread.h"
#include "app/daemon/rate_planner_thread.h"
#include "app/session/assembly.h"
#include "app/session/make_cycle.h"
#include "app/session/place_record.h"
#include "app/session/replay.h"
#include "app/session/session_log.h"
#include "app/session/trace.h"
#include "interp/gcode/parameter_file.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/retrace.h"
#include "kernel/rt_messages.h"
#include "sim/simulated_drives.h"
#include "tests/support/paths.h"
#include "tests/world/clients.h"
#include "tests/world/disk.h"
#include "tests/world/harm.h"
#include "tests/world/programs.h"
#include "tests/world/promises.h"
#include "tests/world/scheduler.h"
#include "tests/world/watched_drives.h"

namespace trn::world {

namespace {

constexpr std::size_t kQueueBlocks = 8192;
constexpr double kFirstOffset_mm = 0.5;
constexpr double kPatience_s = 5;  // of a client
constexpr double kScope_s = 0.2;   // so that the record of a fault is soon written

/// The machine of a session.
struct Site {
  const char* config;
  Means means;
  bool on_can;  ///< emulated drives, which must be homed
};
constexpr Site kMill{"mill", {true, false}, false}, kCradle{"cradle_can", {false, true}, true},
    kGantry{"gantry_router", {false, false}, true};

/// Everything that a seed decides at the beginning.
struct Fate {
  Malice malice;
  double drive_faults = 0;  ///< share of the periods
  Site site = kMill;
  DiskMalice disk;
  std::int64_t length_ns = 0;
  bool power_cut = false, guarded = false, harassed = false, doubted = false;
  int programs = 0;
};

bool one_in(std::mt19937_64& random, unsigned count) { return random() % count == 0; }

Fate draw_fate(std::uint64_t seed, std::mt19937_64& random) {
  Fate fate;
  fate.malice.switch_share = one_in(random, 2) ? 0.02 : 0.3;
  if (one_in(random, 2)) fate.malice.hold_share = 0.0003;
  fate.malice.hold_ns = one_in(random, 4) ? 400 * kMillisecond : 5 * kMillisecond;
  fate.malice.tick_hold_ns = 3 * kMillisecond;
  if (one_in(random, 2)) fate.malice.spurious_share = 0.1;
  if (one_in(random, 3)) fate.drive_faults = 0.0007;
  if (one_in(random, 3))
    fate.disk = {one_in(random, 2) ? 0.1 : 0, 0.3, one_in(random, 2) ? 60 * kMillisecond : 0};
  fate.length_ns = 2 * kSecond + static_cast<std::int64_t>(random() % (4 * kSecond));
  fate.power_cut = one_in(random, 3);
  fate.guarded = one_in(random, 2);
  fate.harassed = one_in(random, 2);
  fate.doubted = one_in(random, 2);
  if (seed % 3 == 0) fate.site = kCradle;
  if (seed % 6 == 1) fate.site = kGantry;
  fate.programs = 1 + static_cast<int>(random() % 3);
  return fate;
}

class ChronicleSink final : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    Chronicle::note(std::string(message.payload.begin(), message.payload.end()));
  }
  void flush_() override {}
};

// The next row in which a joint moves, without its time and the number of its piece, which are no setpoints;
// false at the end.
bool next_moving(std::ifstream& trace, std::string& joints) {
  for (std::string row; std::getline(trace, row);) {
    const std::size_t begin = row.find(','), end = row.rfind(',');
    std::string now = row.substr(begin, end - begin);
    if (now == joints) continue;
    joints = std::move(now);
    return true;
  }
  return false;
}

// "" or the first setpoint in which two traces differ.
std::string compare_traces(const std::string& recorded, const std::string& replayed) {
  std::ifstream one(recorded), other(replayed);
  std::string row, replayed_row;
  for (int count = 0;; ++count) {
    const bool more = next_moving(one, row);
    if (next_moving(other, replayed_row) != more)
      return fmt::format("only the {} goes on behind {} moving rows", more ? "record" : "replay", count);
    if (!more) return "";
    if (row != replayed_row)
      return fmt::format("moving row {}: '{}' was recorded, '{}' replayed", count, row, replayed_row);
  }
}

void write_text(const std::string& path, const std::string& text) { std::ofstream(path) << text; }

std::string read_text(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

void replace(std::string& text, std::string_view what, std::string_view by) {
  const std::size_t at = text.find(what);
  if (at == std::string::npos) throw std::runtime_error(fmt::format("the config has no '{}'", what));
  for (std::size_t i = at; i != std::string::npos; i = text.find(what, i + by.size()))
    text.replace(i, what.size(), by);
}

// Switches near the middle, and joints near their switches: a session has a few seconds.
std::string gantry_config() {
  std::string text = read_text(source_dir() + "/configs/gantry_router.toml");
  replace(text, "eds/servo.eds", source_dir() + "/configs/eds/servo.eds");
  for (const auto& [before, after] : {std::pair{"home_mm = -620.0", "home_mm = -130.0"},
                                      std::pair{"start_mm = -505.0", "start_mm = -124.0"},
                                      std::pair{"home_mm = -1245.0", "home_mm = -130.0"},
                                      std::pair{"home_final_mm = -1240.0", "home_final_mm = -125.0"},
                                      std::pair{"start_mm = -1170.0", "start_mm = -122.0"},
                                      std::pair{"start_mm = 40.0", "start_mm = 95.0"}})
    replace(text, before, after);
  return text;
}

class Life {
 public:
  Life(std::uint64_t seed, std::string folder)
      : random_(seed),
        folder_(std::move(folder)),
        fate_(draw_fate(seed, random_)),
        offsets_(kFirstOffset_mm) {}

  const Fate& fate() const { return fate_; }
  void run();

 private:
  void prepare();
  void serve(Assembly& assembly);
  void direct(ClientWorld& world);
  void judge_disk();
  void judge_replay();
  std::string vars() const { return folder_ + "/kept/mill.var"; }
  std::string place() const { return folder_ + "/kept/mill.place"; }
  const Means& means() const { return fate_.site.means; }
  std::string machine_file() const;
  std::string log() const { return folder_ + "/session.log"; }
  std::string trace() const { return folder_ + "/trace.csv"; }

  std::mt19937_64 random_;
  std::string folder_;
  Fate fate_;
  KeptOffsets offsets_;
  std::vector<std::string> programs_;
  std::uint32_t lost_reports_ = 0;
};

std::string Life::machine_file() const {
  if (fate_.site.config != kGantry.config)
    return fmt::format("{}/configs/{}.toml", source_dir(), fate_.site.config);
  return folder_ + "/gantry.toml";
}

void Life::prepare() {
  std::filesystem::create_directory(folder_ + "/kept");
  if (fate_.site.config == kGantry.config) write_text(machine_file(), gantry_config());
  Parameters parameters;
  parameters[KeptOffsets::kParameter] = kFirstOffset_mm;
  write_text(vars(), parameters_text(parameters));
  for (int i = 0; i < fate_.programs; ++i) {
    programs_.push_back(fmt::format("{}/part{}.ngc", folder_, i));
    write_text(programs_.back(), draw_program(random_, means()));
  }
  Disk::begin(folder_ + "/kept", fate_.disk, random_());
}

// Ends the session, in good order or by a power cut.
void Life::direct(ClientWorld& world) {
  std::this_thread::sleep_for(std::chrono::nanoseconds(fate_.length_ns));
  if (fate_.power_cut) {
    Chronicle::note("power cut");
    judge_disk();
    Chronicle::good_end();
  }
  world.closing = true;
  world.drives.calm_down();
  kill(getpid(), SIGTERM);
}

void Life::judge_disk() {
  const Disk::Content left = Disk::of(vars().c_str())->after_power_cut(vars());
  if (const std::string bad = offsets_.judge(left.there, left.text); !bad.empty())
    Chronicle::finding("kept on disk", bad);
  const Disk::Content place_left = Disk::of(place().c_str())->after_power_cut(place());
  try {
    if (place_left.there) parse_place(place_left.text, "the place of the program");
  } catch (const std::exception& error) {
    Chronicle::finding("kept on disk", error.what());
  }
}

void Life::serve(Assembly& assembly) {
  const auto joints = static_cast<Eigen::Index>(assembly.machine.joints.size());
  const std::unique_ptr<Harm> harm = make_harm(*assembly.drives, joints, fate_.drive_faults, random_());
  WatchedDrives drives(*assembly.drives, assembly.machine, *harm);
  auto plans = std::make_unique<RatePlannerThread>(assembly.plan_joints, assembly.machine.period_s);
  RatePlannerThread& rate_plans = *plans;
  assembly.rate_plans = std::move(plans);
  MotionQueue queue(kQueueBlocks + Retrace::kBlocksKept, std::pmr::get_default_resource(),
                    Retrace::kBlocksKept);
  Door door(assembly.machine.name, assembly.access);
  Cycle cycle = make_cycle(assembly, queue, ProgramStops::kWait, drives, assembly.io.get(), rate_plans);
  SessionLog session_log(make_log_file(log()), session_head("machine", "", vars(), false));
  Parameters parameters;
  load_parameters(vars(), parameters);
  PlannerListeners listeners = planner_listeners(&session_log, nullptr);
  listeners.message = [](std::string_view text, std::uint32_t) {
    Chronicle::note(fmt::format("program: {}", text));
  };
  TraceWriter record(trace(), assembly.machine, *assembly.map, *assembly.corrections.setpoint, false, true);
  PlannerThread programs(assembly, queue, parameters, {}, listeners, {vars(), ""});
  PlaceKeeper place_keeper(place());
  ClientWorld world{
      {assembly.lcm, assembly.access, kPatience_s}, programs_, drives, means(), fate_.site.on_can};
  std::vector<std::thread> clients;
  clients.emplace_back([&, seed = random_()] { operate(world, offsets_, seed); });
  if (fate_.guarded) clients.emplace_back([&, seed = random_()] { guard(world, seed); });
  if (fate_.doubted) clients.emplace_back([&, seed = random_()] { doubt(world, seed); });
  if (fate_.harassed) clients.emplace_back([&, seed = random_()] { harass(world, seed); });
  clients.emplace_back([&] { direct(world); });
  DaemonParts parts{assembly.machine, assembly.lcm, door,     assembly.realtime,
                    drives,           cycle,        programs, rate_plans};
  parts.record = &record;
  parts.log = &session_log;
  parts.map = assembly.map.get();
  parts.chain = assembly.corrections.setpoint.get();
  parts.io = assembly.io.get();
  parts.kinematics = assembly.kinematics.get();
  parts.plan_joints = &assembly.plan_joints;
  parts.place = &place_keeper;
  parts.counters_file = folder_ + "/kept/mill.counters";
  parts.scope.seconds = kScope_s;
  parts.scope.after_fault_s = kScope_s / 4;
  parts.log_file = log();
  parts.on_report = [this](const CycleReport& report) { lost_reports_ = report.lost_reports; };
  run_daemon(parts);
  world.closing = true;
  Disk::of(vars().c_str())->mend();
  programs.settle();
  for (std::thread& client : clients) client.join();
  record.close();
}

// A log that lacks periods, or whose programs failed because of the disk, gives other setpoints.
void Life::judge_replay() {
  if (lost_reports_ > 0 || fate_.disk.fault_share > 0) return;
  const Session session = read_session(log());
  const Assembly assembly = assemble(machine_file());
  Parameters parameters;
  parse_parameters(session.head.vars_text, "variables", parameters);
  ToolTable tools;
  const std::string again = folder_ + "/again.csv";
  TraceWriter writer(again, assembly.machine, *assembly.map, *assembly.corrections.setpoint, false, true);
  replay(session, assembly, parameters, tools, writer);
  writer.close();
  if (const std::string bad = compare_traces(trace(), again); !bad.empty()) Chronicle::finding("replay", bad);
}

void Life::run() {
  prepare();
  {
    Assembly assembly = assemble(machine_file());
    assembly.lcm.url.clear();
    assembly.realtime.cpu = -1;
    assembly.realtime.lock_memory = false;
    assembly.access.socket = folder_ + "/socket";
    serve(assembly);
  }
  judge_disk();
  judge_replay();
}

void block_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

}  // namespace

void live(std::uint64_t seed, bool verbose, int result_fd, const std::string& folder) {
  block_signals();
  setenv("RUNTIME_DIRECTORY", folder.c_str(), 1);
  Chronicle::begin(seed, verbose, result_fd, folder);
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("trunnion", std::make_shared<ChronicleSink>()));
  Life session(seed, folder);
  Scheduler::begin(seed, session.fate().malice,
                   [](const std::string& what) { Chronicle::finding("goes on", what); });
  Scheduler::current()->set_end(Scheduler::current()->now_ns() + session.fate().length_ns + 60 * kSecond);
  try {
    session.run();
  } catch (const std::exception& error) {
    Chronicle::finding("good order", error.what());
  }
  Chronicle::good_end();
}

}  // namespace trn::world

#include "app/daemon/program_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "app/daemon/privileges.h"
#include "app/session/assembly.h"
#include "core/safe_file.h"
#include "interp/gcode/program_config.h"
#include "interp/move.h"
#include "kernel/retrace.h"

namespace trn {

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kAnswerPollMs = 5;
constexpr std::chrono::seconds kGiveUpTime{1};    // for a process that was told to give up
constexpr std::chrono::seconds kSettleTime{10};   // for slow disks
constexpr std::chrono::seconds kTakeBackTime{3};  // the same, where others wait
constexpr const char* kMakerEnded =
    "the one that makes those that plan programs has ended; estop, hold and jogs go on, for programs and "
    "typed lines "
    "restart the daemon";
constexpr std::size_t kSlackBytes = std::size_t{1} << 16;

/// From the process that makes the workers: one began (value: its process), or ended (value: as of waitpid).
struct WorkerNews {
  enum class Kind : std::uint8_t { kBegan, kEnded };
  Kind kind = Kind::kBegan;
  int value = 0;
};

// Ctrl-C in a terminal, and the service manager's end, mean the daemon, which ends this by going.
void live_for_the_daemon() {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) signal(number, SIG_IGN);
}

std::chrono::seconds patience_with(ProgramCall::Kind kind) {
  if (kind == ProgramCall::Kind::kSettle) return kSettleTime;
  return kind == ProgramCall::Kind::kGaveUp ? kTakeBackTime : kGiveUpTime;
}

bool is_waiting(int socket) { return recv(socket, nullptr, 0, MSG_PEEK | MSG_DONTWAIT | MSG_TRUNC) > 0; }

// One at a time, each time that a byte comes.
void make_workers(const ProgramWorkerParts& parts, int calls, int control) {
  std::string old;
  for (char go = 0; recv(control, &go, 1, 0) == 1;) {
    while (is_waiting(calls) && receive_program_packet(calls, old) > 0) continue;  // for one that has died
    const pid_t maker = getpid(), worker = fork();
    if (worker == 0) {
      live_for_the_daemon();
      if (getppid() != maker) _exit(0);
      prctl(PR_SET_NAME, "programs");
      close(control);
      work_on_programs(parts, calls);
      _exit(0);
    }
    WorkerNews news{WorkerNews::Kind::kBegan, worker};
    if (send(control, &news, sizeof news, MSG_NOSIGNAL) < 0) return;
    news = {WorkerNews::Kind::kEnded, 0};
    if (worker > 0) waitpid(worker, &news.value, 0);
    if (send(control, &news, sizeof news, MSG_NOSIGNAL) < 0) return;
  }
}

[[noreturn]] void live_as_maker(const ConfigTable& config, MotionQueue& queue, SharedProgramState& shared,
                                const MemoryFiles& files, std::array<int, 2> ends) {
  live_for_the_daemon();
  prctl(PR_SET_NAME, "program maker");
  try {
    const Assembly assembly = assemble_planning(config);
    const ProgramWorkerParts parts{assembly,
                                   queue,
                                   shared,
                                   files,
                                   assembly.corrections.setpoint->deflection() != nullptr,
                                   static_cast<std::size_t>(assembly.planner.memory_mb) << 20};
    make_workers(parts, ends[0], ends[1]);
  } catch (const std::exception&) {  // the daemon itself tells what is wrong with its config
  }
  _exit(0);
}

std::string ending_text(int status) {
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL)
    return "the process that plans programs was killed: by somebody, or for want of memory";
  if (WIFSIGNALED(status))
    return fmt::format(
        "the process that plans programs died of signal {} ({}); this is a defect of the control: report it "
        "with the program",
        WTERMSIG(status), strsignal(WTERMSIG(status)));
  return "the process that plans programs has ended by itself";
}

std::array<int, 2> socket_pair() {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0)
    throw std::system_error(errno, std::generic_category(), "a pair of sockets");
  return ends;
}

// As far as it is used as more than a number: the process that made it may be out of its mind.
ProgramStep believable(const ProgramStep& step) {
  ProgramStep out = step;
  out.text.back() = out.file.back() = 0;
  int& work_offset = out.settings.modal.work_offset;
  work_offset = std::clamp(work_offset, 1, static_cast<int>(kWorkOffsetCodes.size()));
  return out;
}

}  // namespace

ProgramProcess::ProgramProcess(const ConfigTable& config, const MemoryFiles& files, std::size_t queue_blocks)
    : memory_(MotionQueue::bytes(queue_blocks + Retrace::kBlocksKept) + sizeof(MotionQueue) +
              sizeof(SharedProgramState) + SharedProgramState::bytes(queue_blocks) + kSlackBytes),
      queue_(new (memory_.allocate(sizeof(MotionQueue), alignof(MotionQueue)))
                 MotionQueue(queue_blocks + Retrace::kBlocksKept, &memory_, Retrace::kBlocksKept)),
      shared_(new (memory_.allocate(sizeof(SharedProgramState), alignof(SharedProgramState)))
                  SharedProgramState(queue_blocks, &memory_)) {
  const std::array<int, 2> calls = socket_pair(), control = socket_pair();
  maker_ = fork();
  if (maker_ < 0) throw std::system_error(errno, std::generic_category(), "a process for programs");
  if (maker_ == 0) {
    ::close(calls[0]);
    ::close(control[0]);
    live_as_maker(config, *queue_, *shared_, files, {calls[1], control[1]});
  }
  ::close(calls[1]);
  ::close(control[1]);
  calls_ = calls[0];
  control_ = control[0];
}

ProgramProcess::~ProgramProcess() {
  close();
  ::close(calls_);
  ::close(control_);  // ends the maker, and that its worker
  waitpid(maker_, nullptr, 0);
}

void ProgramProcess::tell(SessionLog* log, FeatureRecorder* features, const ProgramSwitches& switches) {
  log_ = log;
  features_ = features;
  set_switches(switches);
}

void ProgramProcess::hand_on_moves() {
  const std::lock_guard lock(moves_mutex_);
  for (; const ProgramMove* move = shared_->moves.front(); shared_->moves.pop())
    if (features_) features_->programmed(*move);
}

void ProgramProcess::abandon() {
  ++abandons_;
  shared_->abandoned = true;
}

void ProgramProcess::close() {
  shared_->closed = true;
  abandon();
}

void ProgramProcess::start(const ProgramStart& start) {
  if (log_) log_->program(start);
  if (!features_) return;
  hand_on_moves();
  features_->begin();
}

std::string ProgramProcess::load_from(const std::string& path, const JointVec& q, std::uint32_t line) {
  ProgramCall loading;
  loading.path = path;
  loading.q = q;
  loading.line = line;
  return call(loading, [&](const ProgramReply&) {
    ProgramStart program{path, std::nullopt, q};
    program.from_line = line;
    program.switches = switches_;
    start(program);
  });
}

std::string ProgramProcess::load_place(const PlaceRecord& place, const JointVec& q, double before_mm) {
  ProgramCall loading;
  loading.kind = ProgramCall::Kind::kLoadPlace;
  loading.text = place_file_text(place);
  loading.q = q;
  loading.before_mm = before_mm;
  return call(loading, [&](const ProgramReply& starts) {
    ProgramStart program{place.program, std::nullopt, q};
    program.from_line = starts.line;
    program.from_block = starts.block;
    program.from_place = entry_place(starts.stands);
    program.block_delete_changes = place.block_delete_changes;
    program.measured = place.measured;
    if (place.began.size() == q.size()) program.began = place.began;
    program.switches = switches_;
    start(program);
  });
}

void ProgramProcess::check_place(const PlaceRecord& place, const JointVec& q) {
  ProgramCall checking;
  checking.kind = ProgramCall::Kind::kCheckPlace;
  checking.text = place_file_text(place);
  checking.q = q;
  call(checking);
}

void ProgramProcess::delete_tool(int number, const std::string& path, const JointVec& q) {
  ProgramCall deleting;
  deleting.kind = ProgramCall::Kind::kDeleteTool;
  deleting.tool = number;
  deleting.path = path;
  deleting.q = q;
  call(deleting);
  if (log_) log_->tool_deleted(number);
}

void ProgramProcess::load_mdi(const std::string& text, const JointVec& q) {
  ProgramCall mdi;
  mdi.kind = ProgramCall::Kind::kMdi;
  mdi.text = text;
  mdi.q = q;
  {
    const std::lock_guard lock(outputs_mutex_);
    mdi.outputs = outputs_;
  }
  call(mdi, [&](const ProgramReply&) {
    ProgramStart program{"mdi", text, q};
    program.switches = switches_;
    program.outputs = mdi.outputs;
    start(program);
  });
}

void ProgramProcess::confirm_tool(int number) {
  ProgramCall confirmed;
  confirmed.kind = ProgramCall::Kind::kConfirmTool;
  confirmed.tool = number;
  call(confirmed);
}

std::string ProgramProcess::tool_name(int number) const {
  if (number == 0) return "no tool";
  const std::lock_guard lock(names_mutex_);
  const auto found = tool_names_.find(number);
  return found == tool_names_.end() ? fmt::format("tool {}", number) : found->second;
}

void ProgramProcess::set_switches(const ProgramSwitches& switches) {
  switches_ = switches;
  shared_->optional_stop = switches.optional_stop;
}

void ProgramProcess::set_outputs(const MachineOutputs& outputs) {
  const std::lock_guard lock(outputs_mutex_);
  outputs_ = outputs;
}

ReadingPlace ProgramProcess::switch_block_delete(bool on) {
  ProgramCall call;
  call.kind = ProgramCall::Kind::kBlockDelete;
  call.line = on ? 1 : 0;
  const ProgramReply reply = answer_to(call, {});
  if (log_ && reply.line > 0) log_->block_delete({reply.block, on});
  ProgramSwitches switches = switches_;
  switches.block_delete = on;
  switches_ = switches;
  return {reply.block, reply.line, reply.text};
}

HeldLines ProgramProcess::obey_held(const std::string& text, const JointVec& q) {
  ProgramCall call;
  call.kind = ProgramCall::Kind::kHeld;
  call.text = text;
  call.q = q;
  const ProgramReply reply = answer_to(call, {});
  if (reply.stands.size() != 6) throw ProgramError("the process that plans programs gave no place");
  HeldLines lines{reply.block, text, {}};
  std::copy_n(reply.stands.begin(), 6, lines.stands.begin());
  if (log_) log_->held(lines);
  return lines;
}

void ProgramProcess::settle() {
  shared_->abandoned = true;
  ProgramCall settling;
  settling.kind = ProgramCall::Kind::kSettle;
  if (worker_ == 0) return;  // it had nothing to keep
  try {
    call(settling);
  } catch (const ProgramError& error) {
    throw FileError(error.what());
  }
}

std::string ProgramProcess::call(const ProgramCall& what, const Go& go) { return answer_to(what, go).text; }

ProgramReply ProgramProcess::answer_to(const ProgramCall& what, const Go& go) {
  const std::lock_guard lock(mutex_);
  ProgramCall with_switches = what;
  with_switches.switches = switches_;
  if (what.kind != ProgramCall::Kind::kMdi) {  // whose log has those that it was called with
    const std::lock_guard outputs_lock(outputs_mutex_);
    with_switches.outputs = outputs_;
  }
  const std::uint32_t abandons = abandons_;
  ProgramReply reply;
  try {
    reply = ask(with_switches, go);
  } catch (const ProgramError&) {
    // The one before may have hung, and was ended for it: this one was not at fault.
    if (ended_why_.empty() || abandons != abandons_) throw;
    reply = ask(with_switches, go);
  }
  if (reply.kind == ProgramReply::Kind::kRefused) throw ProgramError(reply.text);
  const std::lock_guard names_lock(names_mutex_);
  tool_names_ = std::move(reply.tools);
  return reply;
}

ProgramReply ProgramProcess::ask(const ProgramCall& what, const Go& go) {
  look_for_end();
  if (worker_ == 0) begin_worker();
  ended_why_.clear();
  if (send_program_packet(calls_, encode(what)) < 0) {
    const int error = errno;
    if (const std::string end = look_for_end(); !end.empty()) throw ProgramError(end);
    throw ProgramError(fmt::format("the program is too long for a call: {}", std::strerror(error)));
  }
  std::string packet;
  for (Clock::time_point given_up{};;) {
    pollfd waits[] = {{calls_, POLLIN, 0}, {control_, POLLIN, 0}};
    poll(waits, 2, kAnswerPollMs);
    if (waits[0].revents && receive_program_packet(calls_, packet) > 0) {
      const ProgramReply reply = decode_reply(packet);
      if (reply.kind == ProgramReply::Kind::kStarts) {
        if (go) go(reply);
        send_program_packet(calls_, "go");
      } else if (reply.answers()) {
        return reply;
      } else {
        hear(reply);
      }
      continue;
    }
    if (const std::string end = look_for_end(); !end.empty()) throw ProgramError(end);
    if (!shared_->abandoned)
      given_up = {};
    else if (given_up == Clock::time_point{})
      given_up = Clock::now();
    else if (Clock::now() - given_up > patience_with(what.kind))
      end_worker("the process that plans programs did not give up its program, and was ended");
  }
}

void ProgramProcess::show() {
  ProgramCall show;
  show.kind = ProgramCall::Kind::kShow;
  call(show);
}

// A process that began since knows of none: the program's own file is known here.
void ProgramProcess::check_files() {
  ProgramCall check;
  check.kind = ProgramCall::Kind::kCheckFiles;
  call(check);
}

void ProgramProcess::starts() {
  ProgramCall starts;
  starts.kind = ProgramCall::Kind::kStarts;
  call(starts);
}

// A process that began since has read nothing.
void ProgramProcess::gave_up_at(std::uint64_t block) {
  if (worker_ == 0) return;
  if (log_) log_->taken_back(block);
  ProgramCall gave_up;
  gave_up.kind = ProgramCall::Kind::kGaveUp;
  gave_up.block = block;
  call(gave_up);
}

const ProgramStep* ProgramProcess::step(std::uint32_t number) {
  for (; const ProgramStep* stands = shared_->stands.front(); shared_->stands.pop()) {
    stands_ = believable(*stands);
    stands_known_ = true;
  }
  const std::uint32_t program = shared_->program;
  for (; const NumberedStep* next = shared_->steps.front(); shared_->steps.pop()) {
    const bool due = next->step.source.step <= number;
    if (next->program == program && !due) break;
    if (next->program != program) continue;
    if (steps_.size() == kStepsKept) steps_.pop_front();
    steps_.push_back({program, believable(next->step)});
  }
  if (number == 0) return stands_known_ ? &stands_ : nullptr;
  // The motion may have gone back along its path.
  const auto from = std::find_if(steps_.rbegin(), steps_.rend(), [&](const NumberedStep& step) {
    return step.program != program || step.step.source.step <= number;
  });
  return from != steps_.rend() && from->program == program ? &from->step : nullptr;
}

void ProgramProcess::hear(const ProgramReply& said) {
  const std::lock_guard lock(said_mutex_);
  if (said.kind == ProgramReply::Kind::kSays) said_.push_back({said.line, said.text});
  if (said.kind == ProgramReply::Kind::kTables) tables_ = said.tables;
  if (said.kind == ProgramReply::Kind::kMeasured) measured_.push_back({said.measured, said.line != 0});
  if (said.kind == ProgramReply::Kind::kTime && said.program == shared_->program) time_ = said.time;
}

bool ProgramProcess::take_tables(trunnion::tables_t& tables) {
  const std::lock_guard lock(said_mutex_);
  if (!tables_) return false;
  tables = *std::exchange(tables_, std::nullopt);
  return true;
}

std::vector<ProgramSource::Measured> ProgramProcess::take_measured() {
  const std::lock_guard lock(said_mutex_);
  return std::exchange(measured_, {});
}

bool ProgramProcess::take_program_time(ProgramTime& time) {
  const std::lock_guard lock(said_mutex_);
  if (!time_) return false;
  time = *std::exchange(time_, std::nullopt);
  return true;
}

std::vector<ProgramMessage> ProgramProcess::take_messages() {
  const std::lock_guard lock(said_mutex_);
  return std::exchange(said_, {});
}

void ProgramProcess::begin_worker() {
  shared_->moves.clear();
  // Answers to a process that has died are nobody's.
  std::string old;
  while (is_waiting(calls_) && receive_program_packet(calls_, old) > 0) continue;
  WorkerNews news;
  const char go = 'g';
  if (send(control_, &go, 1, MSG_NOSIGNAL) != 1 || recv(control_, &news, sizeof news, 0) != sizeof news)
    throw ProgramError(fmt::format("no process for programs can be made: {}", kMakerEnded));
  if (news.value < 0) throw ProgramError("no process for programs can be made on this host now");
  worker_ = news.value;
}

// "" while it is at work, or none is.
std::string ProgramProcess::look_for_end() {
  WorkerNews news;
  if (worker_ == 0) return "";
  const ssize_t got = recv(control_, &news, sizeof news, MSG_DONTWAIT);
  const bool maker_ended = got == 0;  // and its worker died with it
  if (got != sizeof news && !maker_ended) return "";
  worker_ = 0;
  queue_->replace_writer();
  if (maker_ended) return kMakerEnded;
  return ended_why_.empty() ? ending_text(news.value) : ended_why_;
}

void ProgramProcess::end_worker(const std::string& why) {
  if (!ended_why_.empty() || worker_ == 0) return;
  ended_why_ = why;
  kill(worker_, SIGKILL);
}

std::string ProgramProcess::take_failure() {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return "";
  try {
    for (std::string packet; is_waiting(calls_) && receive_program_packet(calls_, packet) > 0;) {
      const ProgramReply reply = decode_reply(packet);
      hear(reply);
      if (reply.kind == ProgramReply::Kind::kFailed) return reply.text;
    }
  } catch (const std::exception& error) {  // it is out of its mind, whoever drove it there
    end_worker(fmt::format("the process that plans programs was ended: it sends what nobody understands ({})",
                           error.what()));
  }
  std::string end = look_for_end();
  if (!end.empty()) lost_ = true;
  return end;
}

}  // namespace trn

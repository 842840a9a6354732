#include "app/daemon/program_worker.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>

#include "app/daemon/machine_tables.h"
#include "app/daemon/planner_thread.h"
#include "app/daemon/privileges.h"
#include "app/daemon/program_source.h"
#include "app/daemon/program_wire.h"
#include "app/session/pipeline.h"
#include "app/session/place_record.h"
#include "app/session/program_time.h"
#include "core/sanitizer.h"
#include "interp/gcode/measured_values.h"
#include "interp/gcode/parameter_file.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/tool_table.h"

namespace trn {

namespace {

constexpr int kWorkerPollMs = 20;

struct DaemonGone : std::runtime_error {
  DaemonGone() : std::runtime_error("the daemon has gone") {}
};

// Where memory is short, the kernel shall end this process, not the one that moves the machine.
void limit_resources(std::size_t memory_bytes) {
  const rlimit limit{memory_bytes, memory_bytes};
  if (!kSanitized && memory_bytes > 0) setrlimit(RLIMIT_DATA, &limit);
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  const int fd = open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
  if (fd < 0) return;
  if (write(fd, "1000", 4) != 4) errno = 0;  // then it is as likely as others
  close(fd);
}

std::vector<std::string> folders_of(const MemoryFiles& files) {
  std::vector<std::string> folders;
  for (const std::string& file : {files.vars, files.tools})
    if (!file.empty()) folders.push_back(std::filesystem::absolute(file).parent_path());
  if (!files.logs.empty()) folders.push_back(std::filesystem::absolute(files.logs));
  return folders;
}

Parameters read_parameters(const std::string& path) {
  Parameters parameters;
  if (!path.empty() && std::filesystem::exists(path)) load_parameters(path, parameters);
  return parameters;
}

class ProgramWorker {
 public:
  ProgramWorker(const ProgramWorkerParts& parts, int socket)
      : parts_(parts),
        socket_(socket),
        planner_(parts.assembly, parts.queue, read_parameters(parts.files.vars),
                 parts.files.tools.empty() ? ToolTable() : ToolTable::load(parts.files.tools), listeners(),
                 parts.files, {parts.shared.abandoned, parts.shared.closed, parts.shared.optional_stop}) {}

  void serve() {
    std::string packet;
    while (true) {
      pollfd waits{socket_, POLLIN, 0};
      poll(&waits, 1, kWorkerPollMs);
      if (const std::string failure = planner_.take_failure(); !failure.empty())
        tell({ProgramReply::Kind::kFailed, failure, 0, 0, {}, {}});
      if (!waits.revents) continue;
      if (receive_program_packet(socket_, packet) <= 0) throw DaemonGone();
      answer(packet);
    }
  }

 private:
  void tell(const ProgramReply& reply) const {
    if (send_program_packet(socket_, encode(reply)) <= 0) throw DaemonGone();
  }

  void answer(const std::string& packet) {
    ProgramReply reply;
    try {
      obey(decode_call(packet), reply);
      reply.tools = planner_.tool_names();
    } catch (const DaemonGone&) {
      throw;
    } catch (const std::bad_alloc&) {
      reply = {ProgramReply::Kind::kRefused, kNoMemory, 0, 0, {}, {}};
    } catch (const std::exception& error) {
      reply = {ProgramReply::Kind::kRefused, error.what(), 0, 0, {}, {}};
    }
    tell(reply);
  }

  void obey(const ProgramCall& call, ProgramReply& reply) {
    planner_.set_switches(call.switches);
    planner_.set_outputs(call.outputs);
    if (call.kind == ProgramCall::Kind::kHeld) {
      const HeldLines lines = planner_.obey_held(call.text, call.q);
      reply.block = lines.after_block;
      reply.stands.assign(lines.stands.begin(), lines.stands.end());
      return;
    }
    if (call.kind != ProgramCall::Kind::kBlockDelete) {
      reply.text = obey(call);
      return;
    }
    const ReadingPlace place = planner_.switch_block_delete(call.line != 0);
    reply.text = place.file;
    reply.line = place.line;
    reply.block = place.block;
  }

  std::string obey(const ProgramCall& call) {
    switch (call.kind) {
      case ProgramCall::Kind::kLoad:
        return call.line > 1 ? planner_.load_from(call.path, call.q, call.line)
                             : planner_.load(call.path, call.q);
      case ProgramCall::Kind::kLoadPlace:
        return planner_.load_place(parse_place(call.text, "the record"), call.q, call.before_mm);
      case ProgramCall::Kind::kMdi:
        planner_.load_mdi(call.text, call.q);
        return "";
      case ProgramCall::Kind::kConfirmTool:
        planner_.confirm_tool(call.tool);
        return planner_.tool_name(call.tool);
      case ProgramCall::Kind::kSettle:
        planner_.settle();
        return "";
      case ProgramCall::Kind::kShow:
        planner_.show();
        return "";
      case ProgramCall::Kind::kCheckFiles:
        planner_.check_files();
        return "";
      case ProgramCall::Kind::kStarts:
        planner_.starts();
        return "";
      case ProgramCall::Kind::kGaveUp:
        planner_.gave_up_at(call.block);
        return "";
      case ProgramCall::Kind::kCheckPlace:
        planner_.check_place(parse_place(call.text, "the record"), call.q);
        return "";
      case ProgramCall::Kind::kDeleteTool:
        planner_.delete_tool(call.tool, call.path, call.q);
        return "";
      case ProgramCall::Kind::kBlockDelete:
      case ProgramCall::Kind::kHeld:
        break;
    }
    throw std::runtime_error("no such call");
  }

  // The daemon writes into the session's log what begins, before any of its blocks is there.
  PlannerListeners listeners() {
    PlannerListeners out;
    out.starts = [this](const ProgramStart& start) {
      ProgramReply starts{ProgramReply::Kind::kStarts, "", start.from_line, start.from_block, {}, {}};
      if (start.from_place) starts.stands = numbers_of(*start.from_place);
      tell(starts);
      std::string go;
      if (receive_program_packet(socket_, go) <= 0) throw DaemonGone();
    };
    out.message = [this](std::string_view text, std::uint32_t line) {
      tell({ProgramReply::Kind::kSays, std::string(text), line, 0, {}, {}});
    };
    SharedProgramState& shared = parts_.shared;
    if (parts_.tells_moves)
      out.move = [&shared](const ProgramMove& move) { put(move, shared.moves, shared); };
    out.tables = [this](const Parameters& parameters, const ToolTable& tools) {
      const double unit_mm = parts_.assembly.program.parameter_unit_mm;
      send_program_packet(socket_, encode(tables_of(parameters, tools, unit_mm)));
    };
    out.time = [this, &shared](const ProgramTime& time) {
      send_program_packet(socket_,
                          encode({ProgramReply::Kind::kTime, "", 0, 0, {}, {}, shared.program, time}));
    };
    out.measured = [this](const MeasuredValues& measured, bool begins) {
      ProgramReply reply{ProgramReply::Kind::kMeasured, "", begins ? 1U : 0U, 0, {}, {}};
      reply.measured = measured;
      send_program_packet(socket_, encode(reply));
    };
    out.begins = [&shared] { ++shared.program; };
    // Who does not look misses what does not fit.
    out.step = [&shared](const ProgramStep& step) { shared.steps.try_push({shared.program, step}); };
    out.stands = [&shared](const ProgramStep& step) { put(step, shared.stands, shared); };
    return out;
  }

  template <typename T>
  static void put(const T& item, SharedRing<T>& ring, const SharedProgramState& shared) {
    while (!ring.try_push(item) && !shared.abandoned)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }

  static constexpr const char* kNoMemory =
      "the program needs more memory than planner.memory_mb allows the process that plans it";

  const ProgramWorkerParts& parts_;
  int socket_;
  PlannerThread planner_;
};

// What cannot be read is the answer to every call.
void refuse_all(int socket, const std::string& why) {
  std::string packet;
  while (receive_program_packet(socket, packet) > 0)
    if (send_program_packet(socket, encode({ProgramReply::Kind::kRefused, why, 0, 0, {}, {}})) <= 0) return;
}

}  // namespace

void work_on_programs(const ProgramWorkerParts& parts, int socket) {
  limit_resources(parts.memory_bytes);
  Rights rights;
  rights.write_folders = folders_of(parts.files);
  rights.real_time = rights.sockets = false;
  give_up_privileges(rights);  // the daemon has told what this host cannot do
  try {
    ProgramWorker(parts, socket).serve();
  } catch (const DaemonGone&) {
  } catch (const std::exception& error) {
    refuse_all(socket, error.what());
  }
}

}  // namespace trn

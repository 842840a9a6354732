#include "app/daemon/program_wire.h"

#include <fmt/format.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "app/session/json_numbers.h"
#include "app/session/measured_json.h"
#include "app/session/plan_time.h"
#include "hal/message_codec.h"

namespace trn {

namespace {

using Json = nlohmann::json;

constexpr std::size_t kNamedToolsMax = 1000, kToolNameMax = 60, kTextMax = 16'000;

// What is cut may end within a letter; JSON wants whole ones.
std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

constexpr const char kTables[] = "tables", kLcmBegin[] = "LC02";

ProgramReply decode_tables(const std::string& packet) {
  ProgramReply reply;
  MessageDispatcher dispatcher;
  dispatcher.subscribe<trunnion::tables_t>(kTables, [&](const trunnion::tables_t& tables) {
    reply.kind = ProgramReply::Kind::kTables;
    reply.tables = tables;
  });
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(packet.data());
  if (!dispatcher.accept({bytes, packet.size()})) throw std::runtime_error("tables that are none");
  return reply;
}

}  // namespace

std::string encode(const ProgramCall& call) {
  std::vector<double> q(call.q.data(), call.q.data() + call.q.size());
  return text_of({{"kind", static_cast<int>(call.kind)},
                  {"path", call.path},
                  {"text", call.text},
                  {"line", call.line},
                  {"q", q},
                  {"off", call.switches.corrections_off},
                  {"block_delete", call.switches.block_delete},
                  {"optional_stop", call.switches.optional_stop},
                  {"dry_run", call.switches.dry_run},
                  {"tool", call.tool},
                  {"before", call.before_mm},
                  {"rpm", call.outputs.rpm},
                  {"coolant", call.outputs.coolant},
                  {"rpm_known", call.outputs.rpm_known},
                  {"broken_off", call.outputs.broken_off},
                  {"block", call.block}});
}

std::string encode(const ProgramReply& reply) {
  Json tools = Json::array();
  for (const auto& [number, name] : reply.tools)
    if (tools.size() < kNamedToolsMax) tools.push_back({number, name.substr(0, kToolNameMax)});
  return text_of({{"kind", static_cast<int>(reply.kind)},
                  {"text", reply.text.substr(0, kTextMax)},
                  {"line", reply.line},
                  {"program", reply.program},
                  {"time", reply.time.time.shares_s()},
                  {"rapid_runs", reply.time.time.rapid_runs()},
                  {"about", reply.time.about},
                  {"block", reply.block},
                  {"stands", reply.stands},
                  {"measured", measured_json(reply.measured)},
                  {"tools", tools}});
}

// In LCM's form, which is checked whole before it is decoded.
std::string encode(const trunnion::tables_t& tables) {
  const EncodedMessage message = encode_message(0, kTables, tables);
  return {message.datagram.begin(), message.datagram.end()};
}

ProgramCall decode_call(const std::string& packet) {
  const Json json = Json::parse(packet);
  ProgramCall call;
  const int kind = whole<int>(json.at("kind"));
  if (kind < 0 || kind > static_cast<int>(ProgramCall::Kind::kGaveUp))
    throw std::runtime_error(fmt::format("no call of kind {}", kind));
  call.kind = static_cast<ProgramCall::Kind>(kind);
  call.path = json.at("path");
  call.text = json.at("text");
  call.line = whole<std::uint32_t>(json.at("line"));
  const auto q = json.at("q").get<std::vector<double>>();
  if (q.size() > static_cast<std::size_t>(kMaxJoints)) throw std::runtime_error("too many joints");
  call.q = Eigen::Map<const Eigen::VectorXd>(q.data(), static_cast<Eigen::Index>(q.size()));
  call.switches = {json.at("off"), json.at("block_delete"), json.at("optional_stop"), json.at("dry_run")};
  call.tool = whole<int>(json.at("tool"));
  call.before_mm = json.at("before");
  call.block = whole<std::uint64_t>(json.at("block"));
  call.outputs = {json.at("rpm"), whole<int>(json.at("coolant")), json.at("rpm_known"),
                  json.at("broken_off")};
  return call;
}

ProgramReply decode_reply(const std::string& packet) {
  if (packet.rfind(kLcmBegin, 0) == 0) return decode_tables(packet);
  const Json json = Json::parse(packet);
  ProgramReply reply;
  const int kind = whole<int>(json.at("kind"));
  if (kind < 0 || kind > static_cast<int>(ProgramReply::Kind::kMeasured))
    throw std::runtime_error(fmt::format("no reply of kind {}", kind));
  reply.kind = static_cast<ProgramReply::Kind>(kind);
  reply.text = json.at("text");
  reply.line = whole<std::uint32_t>(json.at("line"));
  reply.block = json.at("block");
  reply.stands = json.at("stands").get<std::vector<double>>();
  reply.measured = measured_from(json.at("measured"));
  reply.program = whole<std::uint32_t>(json.at("program"));
  reply.time = {PlanTime(json.at("time").get<std::array<double, PlanTime::kKinds>>(), json.at("rapid_runs")),
                true, json.at("about")};
  for (const Json& tool : json.at("tools")) reply.tools[whole<int>(tool.at(0))] = tool.at(1);
  return reply;
}

long send_program_packet(int fd, const std::string& packet) {
  ssize_t sent = -1;
  do sent = send(fd, packet.data(), packet.size(), MSG_NOSIGNAL);
  while (sent < 0 && errno == EINTR);
  return sent;
}

long receive_program_packet(int fd, std::string& packet) {
  packet.resize(kProgramPacketMax);
  ssize_t got = -1;
  do got = recv(fd, packet.data(), packet.size(), 0);
  while (got < 0 && errno == EINTR);
  packet.resize(static_cast<std::size_t>(got > 0 ? got : 0));
  return got;
}

}  // namespace trn

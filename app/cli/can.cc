#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/cli/commands.h"
#include "hal/can/bus.h"
#include "hal/can/cia402.h"
#include "hal/can/eds.h"
#include "hal/can/frame.h"
#include "hal/can/nmt.h"
#include "hal/can/sdo.h"
#include "hal/can/socket_can.h"

namespace trn {

namespace {

constexpr std::int64_t kMs = 1'000'000;

struct CanOptions {
  std::string interface = "can0", eds, object, value, nmt_command;
  int node = 1, nmt_node = 0, last = kNodeIdMax;
  double timeout_s = 0.5, seconds = 0;
  bool json = false;
};

/// What one SDO transfer brought.
struct Outcome {
  bool answered = false;
  std::uint32_t abort_code = 0;
  std::vector<std::uint8_t> data;
};

Outcome transfer(SocketCan& bus, SdoClient& client) {
  std::array<CanFrame, 64> in;
  CanFrame frame;
  while (client.state() == SdoClient::State::kBusy) {
    while (client.next_frame(frame)) bus.send({&frame, 1});
    bus.wait(5 * kMs);
    const int count = bus.receive(in);
    for (int i = 0; i < count; ++i) client.receive(in[static_cast<std::size_t>(i)], bus.now_ns());
    client.poll(bus.now_ns());
  }
  while (client.next_frame(frame)) bus.send({&frame, 1});
  if (client.state() == SdoClient::State::kDone) return {true, 0, client.data()};
  return {client.aborted_by_node(), client.abort_code(), {}};
}

std::vector<CanFilter> answers_of(int node) {
  return {{cob::kSdoAnswer + static_cast<unsigned>(node), 0x7FF}};
}

Outcome read_object(SocketCan& bus, int node, ObjectKey key, double timeout_s) {
  SdoClient client({node, static_cast<std::int64_t>(timeout_s * 1e9), 1 << 20, 64, false});
  client.read(key, bus.now_ns());
  return transfer(bus, client);
}

std::uint64_t unsigned_of(const Outcome& outcome) {
  return get_le(outcome.data.data(), static_cast<int>(std::min<std::size_t>(outcome.data.size(), 8)));
}

Exit scan(const CanOptions& options) {
  std::vector<nlohmann::json> found;
  for (int node = 1; node <= options.last; ++node) {
    SocketCan bus(options.interface, answers_of(node));
    const Outcome type = read_object(bus, node, {0x1000, 0}, options.timeout_s);
    if (!type.answered) continue;
    const Outcome vendor = read_object(bus, node, {0x1018, 1}, options.timeout_s);
    const Outcome product = read_object(bus, node, {0x1018, 2}, options.timeout_s);
    const Outcome name = read_object(bus, node, {0x1008, 0}, options.timeout_s);
    const Outcome status = read_object(bus, node, {0x6041, 0}, options.timeout_s);
    const std::uint64_t profile = unsigned_of(type) & 0xFFFF;
    const std::string state =
        status.data.empty() ? "" : describe_statusword(static_cast<std::uint16_t>(unsigned_of(status)));
    const std::string called(name.data.begin(), name.data.end());
    found.push_back({{"node", node},
                     {"profile", profile},
                     {"vendor", unsigned_of(vendor)},
                     {"product", unsigned_of(product)},
                     {"name", called},
                     {"state", state}});
    if (!options.json)
      fmt::print("node {:>3}  profile {}  vendor 0x{:X} product 0x{:X}  {}  {}\n", node, profile,
                 unsigned_of(vendor), unsigned_of(product), called, state);
  }
  if (options.json) fmt::print("{}\n", nlohmann::json(found).dump());
  if (found.empty()) {
    fmt::print(stderr, "no node answers on {}; check supply, cable, termination and bit rate\n",
               options.interface);
    return Exit::kMachineFault;
  }
  return Exit::kDone;
}

// "0x6041", "0x1018:2" or, with a data sheet, the object's name
ObjectKey parse_object(const std::string& text, const ObjectDictionary* eds) {
  unsigned index = 0, sub = 0;
  int used = 0;
  const int count = std::sscanf(text.c_str(), "0x%4x%n:%u%n", &index, &used, &sub, &used);
  if (count >= 1 && used == static_cast<int>(text.size()) && index <= 0xFFFF && sub <= 255)
    return {static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(sub)};
  if (eds)
    if (const auto found = eds->find_name(text)) return *found;
  throw CLI::ValidationError("object",
                             fmt::format("'{}' is no object; legal: 0x6041, 0x1018:2{}", text,
                                         eds ? ", or a name of the EDS" : ", or a name with --eds"));
}

std::string show_value(ObjectKey key, const DictionaryEntry* entry, const std::vector<std::uint8_t>& data) {
  const bool text =
      entry ? entry->type == DataType::kVisibleString : key.index >= 0x1008 && key.index <= 0x100A;
  if (text) return fmt::format("\"{}\"", std::string(data.begin(), data.end()));
  if (data.empty() || data.size() > 8) return fmt::format("{} bytes", data.size());
  const std::uint64_t value = get_le(data.data(), static_cast<int>(data.size()));
  const std::int64_t number = entry && is_signed(entry->type)
                                  ? get_le_signed(data.data(), static_cast<int>(data.size()))
                                  : static_cast<std::int64_t>(value);
  std::string out = fmt::format("{} (0x{:0{}X})", number, value, 2 * data.size());
  if (key == ObjectKey{0x6041, 0}) out += ": " + describe_statusword(static_cast<std::uint16_t>(value));
  if (key == ObjectKey{0x6040, 0}) out += ": " + describe_controlword(static_cast<std::uint16_t>(value));
  if (key == ObjectKey{0x603F, 0})
    out += ": " + std::string(emergency_text(static_cast<std::uint16_t>(value)));
  return out;
}

std::vector<std::uint8_t> bytes_to_write(const CanOptions& options, const DictionaryEntry* entry,
                                         std::size_t size) {
  const DataType type = entry       ? entry->type
                        : size == 1 ? DataType::kInteger8
                        : size == 2 ? DataType::kInteger16
                                    : DataType::kInteger32;
  std::size_t used = 0;
  long long value = 0;
  try {
    value = std::stoll(options.value, &used, 0);
  } catch (const std::exception&) {
    used = 0;
  }
  std::vector<std::uint8_t> bytes;
  if (used == options.value.size()) bytes = encode_integer(type, value);
  if (bytes.empty())
    throw CLI::ValidationError("value",
                               fmt::format("'{}' is no number of {} bits", options.value, bits_of(type)));
  return bytes;
}

Exit sdo(const CanOptions& options) {
  std::optional<ObjectDictionary> eds;
  if (!options.eds.empty()) eds = load_eds(options.eds, options.node);
  const ObjectKey key = parse_object(options.object, eds ? &*eds : nullptr);
  const DictionaryEntry* entry = eds ? eds->find(key) : nullptr;
  SocketCan bus(options.interface, answers_of(options.node));
  Outcome outcome = read_object(bus, options.node, key, options.timeout_s);
  if (!options.value.empty()) {
    SdoClient client({options.node, static_cast<std::int64_t>(options.timeout_s * 1e9), 1 << 20, 64, false});
    client.write(key, bytes_to_write(options, entry, outcome.data.size()), bus.now_ns());
    outcome = transfer(bus, client);
    if (outcome.abort_code == 0) outcome = read_object(bus, options.node, key, options.timeout_s);
  }
  if (outcome.abort_code != 0) {
    fmt::print(stderr, "node {} {}: {} 0x{:08X} ({})\n", options.node, to_string(key),
               outcome.answered ? "SDO abort" : "given up with", outcome.abort_code,
               sdo_abort_text(outcome.abort_code));
    return Exit::kMachineFault;
  }
  if (options.json)
    fmt::print(
        "{}\n",
        nlohmann::json{{"node", options.node}, {"object", to_string(key)}, {"bytes", outcome.data}}.dump());
  else
    fmt::print("{}{} = {}\n", to_string(key), entry ? " " + entry->name : "",
               show_value(key, entry, outcome.data));
  return Exit::kDone;
}

Exit nmt(const CanOptions& options) {
  for (const NmtCommand command : {NmtCommand::kStart, NmtCommand::kStop, NmtCommand::kPreOperational,
                                   NmtCommand::kResetNode, NmtCommand::kResetCommunication}) {
    if (to_string(command) != options.nmt_command) continue;
    SocketCan bus(options.interface, answers_of(1));
    const CanFrame frame = nmt_frame(command, options.nmt_node);
    if (bus.send({&frame, 1}) == 1) return Exit::kDone;
    fmt::print(stderr, "the frame could not be sent on {}\n", options.interface);
    return Exit::kMachineFault;
  }
  return Exit::kUsage;
}

// CiA 301, 7.2.4.3: what begins or ends a transfer names its object.
std::string describe_sdo(const CanFrame& frame, const ObjectDictionary* eds) {
  const unsigned node = frame.id & 0x7F, command = frame.data[0] >> 5;
  const bool request = (frame.id & 0x780) == cob::kSdoRequest;
  if (frame.size < 8) return "";
  const ObjectKey key{static_cast<std::uint16_t>(get_le(frame.data.data() + 1, 2)), frame.data[3]};
  const std::string object = to_string(key) + (eds && eds->find(key) ? " " + eds->name_of(key) : "");
  if (command == 4) {
    const auto code = static_cast<std::uint32_t>(get_le(frame.data.data() + 4, 4));
    return fmt::format("SDO node {}: {} aborted: 0x{:08X} ({})", node, object, code, sdo_abort_text(code));
  }
  const bool carries = (frame.data[0] & 2) != 0 && command == (request ? 1u : 2u);  // expedited
  const int unused = frame.data[0] & 1 ? frame.data[0] >> 2 & 3 : 0;
  const std::string value =
      carries ? " = " + show_value(key, eds ? eds->find(key) : nullptr,
                                   {frame.data.begin() + 4, frame.data.begin() + 8 - unused})
              : "";
  if (request && command == 1) return fmt::format("SDO node {}: write {}{}", node, object, value);
  if (request && command == 2) return fmt::format("SDO node {}: read {}", node, object);
  if (!request && command == 3) return fmt::format("SDO node {}: {} written", node, object);
  if (!request && command == 2) return fmt::format("SDO node {}: {}{}", node, object, value);
  return fmt::format("SDO {} node {}, goes on", request ? "to" : "of", node);
}

std::string describe(const CanFrame& frame, const ObjectDictionary* eds) {
  const unsigned node = frame.id & 0x7F, function = frame.id & 0x780;
  if (frame.error) return "error report of the controller";
  if (frame.extended) return "";
  if (frame.id == cob::kNmt && frame.size >= 2)
    return fmt::format("NMT {} to {}", to_string(static_cast<NmtCommand>(frame.data[0])),
                       frame.data[1] == 0 ? "all" : fmt::format("node {}", frame.data[1]));
  if (frame.id == cob::kSync) return "SYNC";
  if (function == cob::kEmergency && frame.size >= 2)
    return fmt::format("emergency of node {}: 0x{:04X} ({})", node, get_le(frame.data.data(), 2),
                       emergency_text(static_cast<std::uint16_t>(get_le(frame.data.data(), 2))));
  if (function == cob::kGuard && frame.size >= 1)
    return fmt::format("node {}: {}", node, to_string(nmt_state(frame.data[0])));
  if (function == cob::kTpdo1 && frame.size >= 2)
    return fmt::format("node {} feedback: {}", node,
                       describe_statusword(static_cast<std::uint16_t>(get_le(frame.data.data(), 2))));
  if (function == cob::kRpdo1 && frame.size >= 2)
    return fmt::format("node {} setpoint: {}", node,
                       describe_controlword(static_cast<std::uint16_t>(get_le(frame.data.data(), 2))));
  if (function == cob::kSdoAnswer || function == cob::kSdoRequest) return describe_sdo(frame, eds);
  return "";
}

Exit print_frames(const CanOptions& options) {
  std::optional<ObjectDictionary> eds;
  if (!options.eds.empty()) eds = load_eds(options.eds, options.node);
  SocketCan bus(options.interface, {});
  const std::int64_t begin_ns = bus.now_ns();
  std::int64_t first_ns = 0;  // the kernel's stamp of reception
  std::array<CanFrame, 64> in;
  while (options.seconds <= 0 || static_cast<double>(bus.now_ns() - begin_ns) < options.seconds * 1e9) {
    bus.wait(100 * kMs);
    const int count = bus.receive(in);
    for (int i = 0; i < count; ++i) {
      const CanFrame& frame = in[static_cast<std::size_t>(i)];
      if (first_ns == 0) first_ns = frame.time_ns;
      fmt::print("{:.6f}  {:<32}  {}\n", static_cast<double>(frame.time_ns - first_ns) * 1e-9,
                 to_string(frame), describe(frame, eds ? &*eds : nullptr));
    }
    std::fflush(stdout);
  }
  return Exit::kDone;
}

}  // namespace

void add_can(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<CanOptions>();
  CLI::App* can = app.add_subcommand("can", "Look at the nodes of a CANopen bus, and talk to them");
  can->require_subcommand(1);
  const auto add = [&](const std::string& name, const std::string& help, Exit (*command)(const CanOptions&)) {
    CLI::App* sub = can->add_subcommand(name, help);
    sub->add_option("--can", options->interface, "Interface")->capture_default_str();
    sub->callback([&exit, options, command] { exit = command(*options); });
    return sub;
  };
  const auto add_common = [&](CLI::App* sub) {
    sub->add_option("--timeout", options->timeout_s, "Seconds to wait for an answer")
        ->check(CLI::PositiveNumber);
    sub->add_flag("--json", options->json, "Write JSON, for programs");
  };
  CLI::App* scan_app = add("scan", "Ask every node id who it is", scan);
  scan_app->add_option("--last", options->last, "Highest node id to ask")->check(CLI::Range(1, kNodeIdMax));
  add_common(scan_app);
  CLI::App* sdo_app = add("sdo", "Read or write an object of a node's dictionary", sdo);
  sdo_app->add_option("node", options->node, "Node id")->required()->check(CLI::Range(1, kNodeIdMax));
  sdo_app->add_option("object", options->object, "0x6041, 0x1018:2, or a name with --eds")->required();
  sdo_app->add_option("value", options->value, "Write this number (0x.. or decimal) instead of only reading");
  sdo_app->add_option("--eds", options->eds, "Data sheet of the node: names and types")
      ->check(CLI::ExistingFile);
  sdo_app->footer("Example: trunnion can sdo 3 \"Statusword\" --eds configs/eds/servo.eds");
  add_common(sdo_app);
  CLI::App* nmt_app = add("nmt", "Send a network management command", nmt);
  nmt_app->add_option("command", options->nmt_command, "What the nodes shall do")
      ->required()
      ->check(CLI::IsMember({"start", "stop", "pre-operational", "reset-node", "reset-communication"}));
  nmt_app->add_option("node", options->nmt_node, "Node id; 0: all")->check(CLI::Range(0, kNodeIdMax));
  CLI::App* monitor_app = add("monitor", "Print every frame, decoded", print_frames);
  monitor_app
      ->add_option("--eds", options->eds, "Data sheet of the nodes: names of the objects in SDO transfers")
      ->check(CLI::ExistingFile);
  monitor_app->add_option("--seconds", options->seconds, "End after this time; 0: with Ctrl-C");
  add_can_settings(*can, exit);
  add_can_faults(*can, exit);
}

}  // namespace trn

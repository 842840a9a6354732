#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/cli/commands.h"
#include "hal/can/lss.h"
#include "hal/can/nmt.h"
#include "hal/can/socket_can.h"
#include "hal/can/store_parameters.h"

// What stays in a node when its power is gone: node id and bit rate (CiA 305), parameters (0x1010).
namespace trn {

namespace {

constexpr std::array kIdentityNames = {"--vendor", "--product", "--revision", "--serial"};

struct SettingOptions {
  std::string interface = "can0", part;
  std::array<std::optional<std::uint32_t>, 4> identity;
  int node = 0, bitrate = 0;
  double lss_timeout_s = 0.02, timeout_s = 0.5;
  bool store = false, json = false;
};

constexpr const char kLssFooter[] =
    "Without an identity it finds a node that has no node id yet. With several of them, the lowest identity "
    "comes "
    "first.\nIt needs the bus for itself: end the daemon before.\n"
    "  trunnion can lss                                   who has no node id?\n"
    "  trunnion can lss --node 5 --store                  give it one\n"
    "  trunnion can lss --vendor 0x2E --product 0x402 --revision 0x10000 --serial 77 --node 5 --store\n"
    "A bit rate acts when the node is switched off and on, and needs --store. Set it in all nodes of the bus "
    "first.\n"
    "Exit: 0 done, 4 no such node or it refuses, 5 usage.";

constexpr const char kStoreFooter[] =
    "Nothing else in Trunnion ever stores. What the config says is written at every bring-up, so this is for "
    "other "
    "masters,\nand for parameters that you have set with `can sdo`. With the communication part, heartbeat "
    "and SYNC "
    "period are\nset to 0 before: stored, they would hide that the drive was restarted. Give `reset` "
    "afterwards.\n"
    "  trunnion can store 3 application\n"
    "Exit: 0 stored, 4 the node cannot or does not, 5 usage.";

std::optional<LssIdentity> identity_of(const SettingOptions& options) {
  LssIdentity out{};
  std::string missing;
  std::size_t given = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (options.identity[i]) ++given, out[i] = *options.identity[i];
    if (!options.identity[i]) missing += fmt::format("{}{}", missing.empty() ? "" : ", ", kIdentityNames[i]);
  }
  if (given == 0) return std::nullopt;
  if (given < out.size())
    throw CLI::ValidationError(missing,
                               "an identity has four numbers, as on the node's label or in its 0x1018");
  return out;
}

/// Everybody waits again, whatever happens in between.
class LssTalk {
 public:
  explicit LssTalk(const SettingOptions& options)
      : bus_(options.interface, {{lss::kToMaster, 0x7FF}}),
        master_(static_cast<std::int64_t>(options.lss_timeout_s * 1e9)) {}
  ~LssTalk() {
    master_.leave(bus_.now_ns());
    run_lss(bus_, master_);
  }
  LssTalk(const LssTalk&) = delete;
  LssTalk& operator=(const LssTalk&) = delete;

  template <typename Begin>
  bool done(Begin begin) {
    begin(master_, bus_.now_ns());
    const std::string error = run_lss(bus_, master_);
    if (!error.empty()) fmt::print(stderr, "{}\n", error);
    return error.empty();
  }
  const LssMaster& master() const { return master_; }

 private:
  SocketCan bus_;
  LssMaster master_;
};

bool set(LssTalk& talk, const SettingOptions& options) {
  if (options.node != 0 &&
      !talk.done([&](LssMaster& m, std::int64_t now) { m.set_node_id(options.node, now); }))
    return false;
  const auto rate = lss_bit_rate_index(options.bitrate);
  if (rate && !talk.done([&](LssMaster& m, std::int64_t now) { m.set_bit_rate(*rate, now); })) return false;
  return !options.store || talk.done([](LssMaster& m, std::int64_t now) { m.store(now); });
}

void tell_lss(const SettingOptions& options, const LssIdentity& who, int had) {
  if (options.json) {
    nlohmann::ordered_json out{
        {"vendor", who[0]}, {"product", who[1]}, {"revision", who[2]}, {"serial", who[3]}, {"node", had}};
    if (options.node != 0) out["node_set"] = options.node;
    if (options.bitrate != 0) out["bitrate_set"] = options.bitrate;
    out["stored"] = options.store;
    fmt::print("{}\n", out.dump());
    return;
  }
  fmt::print("{}, {}\n", to_string(who),
             had == lss::kNoNodeId ? "without a node id" : fmt::format("node {}", had));
  const char* until = options.store ? "stored" : "until it is switched off";
  if (options.node != 0) fmt::print("node id {} set, {}\n", options.node, until);
  if (options.node != 0 && had != lss::kNoNodeId)
    fmt::print("it acts when the node is told: trunnion can nmt reset-communication {}\n", had);
  if (options.bitrate != 0)
    fmt::print("bit rate {} set, {}; it acts when the node is switched off and on\n", options.bitrate, until);
}

Exit lss_command(const SettingOptions& options) {
  const auto identity = identity_of(options);
  if (options.bitrate != 0 && !lss_bit_rate_index(options.bitrate))
    throw CLI::ValidationError("--bitrate", fmt::format("{} is not in the standard's table; legal: {}",
                                                        options.bitrate, lss_bit_rates()));
  if (options.bitrate != 0 && !options.store)
    throw CLI::ValidationError("--bitrate",
                               "it acts when the node is switched off and on, and needs --store");
  if (options.store && options.node == 0 && options.bitrate == 0)
    throw CLI::ValidationError("--store", "there is nothing to store; say --node or --bitrate");
  LssTalk talk(options);
  const bool selected =
      talk.done([&](LssMaster& m, std::int64_t now) { identity ? m.select(*identity, now) : m.find(now); });
  if (!selected) return Exit::kMachineFault;
  const LssIdentity who = talk.master().identity();
  if (!talk.done([](LssMaster& m, std::int64_t now) { m.ask_node_id(now); })) return Exit::kMachineFault;
  const int had = talk.master().node_id();
  if (!set(talk, options)) return Exit::kMachineFault;
  tell_lss(options, who, had);
  return Exit::kDone;
}

Exit store_command(const SettingOptions& options) {
  const StoredPart part = options.part == "all"             ? StoredPart::kAll
                          : options.part == "communication" ? StoredPart::kCommunication
                                                            : StoredPart::kApplication;
  SocketCan bus(options.interface, {{cob::kSdoAnswer + static_cast<unsigned>(options.node), 0x7FF}});
  try {
    const auto timeout_ns = static_cast<std::int64_t>(options.timeout_s * 1e9);
    for (const std::string& line : store_parameters(bus, options.node, part, timeout_ns))
      fmt::print("node {}: {}\n", options.node, line);
    return Exit::kDone;
  } catch (const StoreError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return Exit::kMachineFault;
  }
}

}  // namespace

void add_can_settings(CLI::App& can, Exit& exit) {
  auto options = std::make_shared<SettingOptions>();
  CLI::App* lss =
      can.add_subcommand("lss", "Find a node without a node id, give it one, set its bit rate (CiA 305)");
  lss->add_option("--can", options->interface, "Interface")->capture_default_str();
  constexpr std::array kMeanings = {"Maker's number of the node", "Its product code", "Its revision number",
                                    "Its serial number"};
  for (std::size_t i = 0; i < kIdentityNames.size(); ++i)
    lss->add_option(kIdentityNames[i], options->identity[i], kMeanings[i]);
  lss->add_option("--node", options->node, "The node id that it gets; 255: none")
      ->check(CLI::Range(1, kNodeIdMax) | CLI::IsMember({lss::kNoNodeId}));
  lss->add_option("--bitrate", options->bitrate, "The bit rate that it gets, bits per second");
  lss->add_flag("--store", options->store, "It keeps them when it is switched off");
  lss->add_option("--timeout", options->lss_timeout_s,
                  "Seconds to wait for each answer; a search waits 133 times")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  lss->add_flag("--json", options->json, "Write JSON, for programs");
  lss->footer(kLssFooter);
  lss->callback([&exit, options] { exit = lss_command(*options); });
  CLI::App* store =
      can.add_subcommand("store", "Have a node keep its parameters when it is switched off (0x1010)");
  store->add_option("--can", options->interface, "Interface")->capture_default_str();
  store->add_option("node", options->node, "Node id")->required()->check(CLI::Range(1, kNodeIdMax));
  store->add_option("part", options->part, "What it keeps")
      ->required()
      ->check(CLI::IsMember({"all", "communication", "application"}));
  store
      ->add_option("--timeout", options->timeout_s,
                   "Seconds to wait for an answer; storing itself may take 20")
      ->check(CLI::PositiveNumber);
  store->footer(kStoreFooter);
  store->callback([&exit, options] { exit = store_command(*options); });
}

}  // namespace trn

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/fault.h"
#include "core/ports.h"
#include "hal/can/bus.h"
#include "hal/can/can_config.h"
#include "hal/can/can_master.h"
#include "hal/can/cia402.h"
#include "hal/can/frame.h"
#include "hal/can/nmt.h"
#include "hal/can/node_link.h"
#include "hal/can/node_setup.h"
#include "hal/can/pdo.h"
#include "hal/can/sdo.h"
#include "tests/fuzz/require.h"

// Fuzz target: any frames from a CAN bus into what listens there. The first byte says who: the master in the
// tick, a service data transfer, or the bring-up of a node.
namespace {

using namespace trn;
using fuzz::require;

constexpr int kFirst = 1, kSecond = 2;  // nodes
constexpr std::size_t kFramesMax = 2 + 5 * 2;
constexpr int kPeriodsMax = 300;

/// An identifier, flags with the length, and data. The lower half of the first byte chooses among identifiers
/// that mean something.
CanFrame frame_of(fuzz::Bytes& in) {
  constexpr std::uint32_t kIds[] = {0x181, 0x281, 0x182, 0x701, 0x702, 0x081, 0x082, 0x581,
                                    0x201, 0x202, 0x080, 0x77F, 0x581, 0x181, 0x182};
  CanFrame frame;
  const unsigned choice = in.byte() & 15u;
  frame.id = choice < std::size(kIds) ? kIds[choice] : in.byte() * 8u;
  const std::uint8_t flags = in.byte();
  frame.extended = flags == 0xF0;
  frame.remote = flags == 0xF1;
  frame.error = flags == 0xF2;
  const int length = flags >= 0xF0 ? 8 : std::min(flags & 0x7F, 64);
  frame.fd = length > 8;
  frame.size = static_cast<std::uint8_t>(length);
  std::ranges::copy(in.some(frame.size), frame.data.begin());
  return frame;
}

bool foreign_form(const CanFrame& frame) { return frame.extended || frame.remote || frame.error; }

/// Feeds frames and keeps what is sent.
class FedBus final : public CanEndpoint {
 public:
  int send(std::span<const CanFrame> frames) TRN_RT override {
    const std::size_t taken = std::min(frames.size(), room);
    sent.assign(frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(taken));
    return static_cast<int>(taken);
  }
  int receive(std::span<CanFrame> frames) TRN_RT override {
    const std::size_t count = std::min(frames.size(), waiting.size());
    std::copy_n(waiting.begin(), count, frames.begin());
    waiting.erase(waiting.begin(), waiting.begin() + static_cast<std::ptrdiff_t>(count));
    return static_cast<int>(count);
  }
  BusState state() const TRN_RT override { return bus_state; }
  std::int64_t now_ns() const TRN_RT override { return time_ns; }
  std::int64_t confirmed_ns() const TRN_RT override { return time_ns - 300'000; }
  void wait(std::int64_t) override {}
  std::string recover() override { return ""; }

  std::vector<CanFrame> sent, waiting;
  std::size_t room = kFramesMax;
  BusState bus_state = BusState::kOnline;
  std::int64_t time_ns = 1'000'000'000;
};

Pdo pdo_of(std::uint32_t id, std::uint16_t number, const std::vector<std::pair<ObjectKey, int>>& objects) {
  Pdo pdo;
  pdo.id = id;
  pdo.number = number;
  for (const auto& [key, bits] : objects) {
    const int byte = pdo.size();
    pdo.fields.push_back({key, bits, byte});
  }
  return pdo;
}

// Position mode, two TPDOs of eight bytes at most.
NodeLink::Config first_node() {
  NodeLink::Config link;
  link.id = kFirst;
  link.name = "can0 node 1 (joint X)";
  link.tpdos = {pdo_of(0x181, 0, {{{0x6041, 0}, 16}, {{0x6064, 0}, 32}, {{0x6061, 0}, 8}}),
                pdo_of(0x281, 1, {{{0x60FD, 0}, 32}, {{0x60B9, 0}, 16}})};
  link.rpdos = {pdo_of(0x201, 0, {{{0x6040, 0}, 16}, {{0x607A, 0}, 32}, {{0x6060, 0}, 8}}),
                pdo_of(0x301, 1, {{{0x60B8, 0}, 16}})};
  link.rpdos[1].every = 3;
  link.watch = {3, 50, 0};
  link.axis.counts_per_unit = 1000;
  link.axis.following_error_max = 2;
  link.axis.step_max = 1;
  link.axis.enable_periods_max = link.axis.homing_periods_max = 40;
  return link;
}

// Velocity mode, one TPDO in an FD frame, guarded.
NodeLink::Config second_node() {
  NodeLink::Config link;
  link.id = kSecond;
  link.joint = 1;
  link.name = "can0 node 2 (joint Y)";
  link.tpdos = {pdo_of(0x182, 0,
                       {{{0x6041, 0}, 16},
                        {{0x6064, 0}, 32},
                        {{0x6061, 0}, 8},
                        {{0x60B9, 0}, 16},
                        {{0x60BA, 0}, 32},
                        {{0x60BB, 0}, 32}})};
  link.rpdos = {pdo_of(0x202, 0, {{{0x6040, 0}, 16}, {{0x60FF, 0}, 32}, {{0x60B8, 0}, 16}})};
  link.tpdos[0].fd = link.rpdos[0].fd = true;
  link.watch = {3, 0, 10};
  link.axis.mode = Cia402Mode::kCyclicVelocity;
  link.axis.counts_per_unit = -1e6;
  link.axis.absolute = true;
  return link;
}

CanMaster::Config master_of_two() {
  CanMaster::Config config;
  config.period_s = 0.001;
  config.heartbeat_periods = 10;
  config.sync_counter = 240;
  config.bus.interface = "can0";
  config.bus.fd = true;
  config.bus.data_bitrate = 4e6;
  config.bus.budget.period_s = config.period_s;
  config.bus.nodes.resize(2);
  config.bus.nodes[0].link = first_node();
  config.bus.nodes[1].link = second_node();
  return config;
}

/// The tick with the master of two nodes.
class Tick {
 public:
  Tick() : master_(master_of_two()) {
    master_.attach(&bus_);
    for (NodeLink& node : master_.nodes()) node.shared().watched = true;
  }

  void run(fuzz::Bytes& in) {
    while (!in.empty() && periods_ < kPeriodsMax) act(in);
    period();
    require(!master_.health().empty() && std::isfinite(master_.measured_load()), "the load is a number");
  }

 private:
  void act(fuzz::Bytes& in) {
    const std::uint8_t what = in.byte();
    switch (what & 7u) {
      case 0:
        return operate(master_.nodes()[what >> 3 & 1], what >> 4);
      case 1:
        bus_.bus_state = static_cast<BusState>((what >> 3) % 3);
        bus_.room = what >> 5 == 7 ? 3 : kFramesMax;
        return;
      case 2:
        q_ += static_cast<std::int8_t>(in.byte()) * 0.01;
        return;
      case 3:
      case 4:
        for (int i = 0; i <= what >> 3; ++i) period();
        return;
      default:
        bus_.waiting.push_back(frame_of(in));
    }
  }

  void operate(NodeLink& node, int what) {
    const bool sound = node.fault() == Fault::kOk;
    if (what == 0 && sound) node.axis().enable();
    if (what == 1) node.axis().disable();
    if (what == 2) node.axis().quick_stop();
    if (what == 3 && sound) node.axis().home();
    if (what == 4) node.touch().arm(true);
    if (what == 5) node.touch().arm(false);
    if (what == 6) node.touch().disarm();
    if (what == 7) node.shared().setups.fetch_add(1);
    if (what == 8) node.shared().position_lost = true;
    if (what == 9) master_.reset();
  }

  void period() {
    ++periods_;
    master_.receive();
    std::array<bool, 2> failed{};
    for (std::size_t i = 0; i < 2; ++i) {
      NodeLink& node = master_.nodes()[i];
      const Fault before = node.axis().fault();
      failed[i] = before != Fault::kOk && fault_info(before).reaction == Reaction::kQuickStop;
      node.step(q_, 0, node.state() == DriveState::kEnabled);
      require(std::isfinite(node.axis().measured()), "a measurement is a number");
      if (node.fault() != told_[i])
        require(node.explain().empty() == (node.fault() == Fault::kOk), "a fault is explained");
      told_[i] = node.fault();
    }
    master_.send();
    bus_.time_ns += 1'000'000;
    for (const CanFrame& frame : bus_.sent) judge(frame, failed);
  }

  static void judge(const CanFrame& frame, const std::array<bool, 2>& failed) {
    constexpr std::uint32_t kOurs[] = {0x080, 0x201, 0x301, 0x202, 0x702, 0x77F};
    require(std::ranges::find(kOurs, frame.id) != std::end(kOurs), "only what is the master's is sent");
    require(!frame.extended && !frame.error && frame.remote == (frame.id == 0x702), "in the master's form");
    const int node = frame.id == 0x201 ? 0 : frame.id == 0x202 ? 1 : -1;
    if (node < 0 || !failed[static_cast<std::size_t>(node)]) return;
    const std::uint64_t control = get_le(frame.data.data(), 2) & 0x0Fu;
    require(control != controlword::kEnable, "a drive at fault is not told to go on");
  }

  FedBus bus_;
  CanMaster master_;
  std::array<Fault, 2> told_{};
  double q_ = 0;
  int periods_ = 0;
};

/// Makes an answer belong to `key` where the fuzzer asks for it; it would seldom find three bytes.
void name_object(CanFrame& frame, ObjectKey key) {
  put_le(frame.data.data() + 1, 2, key.index);
  frame.data[3] = key.sub;
}

void transfer(fuzz::Bytes& in) {
  constexpr ObjectKey kKey{0x1018, 2};
  constexpr std::size_t kMost = 600;
  const std::uint8_t how = in.byte();
  SdoClient client({kFirst, 1'000'000, kMost, how & 1 ? 20u : 0u, (how & 2) != 0});
  std::int64_t now_ns = 0;
  how & 4 ? client.write(kKey, in.some(how >> 3), now_ns) : client.read(kKey, now_ns);
  while (!in.empty()) {
    CanFrame frame = frame_of(in);
    if (frame.id == 0x581 && frame.size == 8 && frame.data[4] & 1) name_object(frame, kKey);
    if (frame.data[0] >> 5 == 6 && frame.data[7] == 'c') {  // the end of a block that is as it should be
      const std::size_t unused = std::min<std::size_t>(frame.data[0] >> 2 & 7, client.data().size());
      put_le(frame.data.data() + 1, 2,
             sdo_crc(std::span(client.data()).first(client.data().size() - unused)));
    }
    client.receive(frame, now_ns += 1000);
    int answers = 0;
    for (CanFrame out; client.next_frame(out); ++answers)
      require(out.id == 0x601 && out.size == 8 && !foreign_form(out), "a request to the node");
    require(answers <= 128, "a bounded answer to one frame");
    if (client.state() == SdoClient::State::kDone)
      require(client.data().size() <= kMost, "no more than there may be");
  }
  client.poll(now_ns + 1'000'000);
  require(client.state() != SdoClient::State::kBusy, "an end when the node is silent");
}

NodeSetup::Config setup_of_three_steps() {
  NodeSetup::Config config;
  config.id = kFirst;
  config.name = "can0 node 1";
  config.signature = {SetupStep::Kind::kCheck, {0x1016, 1}, {10, 0, 127, 0}, "signature", "-"};
  config.steps = {{SetupStep::Kind::kCheck, {0x1018, 1}, {1, 0, 0, 0}, "vendor", "another drive is needed"},
                  {SetupStep::Kind::kWriteIfThere, {0x6085, 0}, {1, 2, 3, 4}, "quick stop", "-"},
                  {SetupStep::Kind::kWrite, {0x2000, 3}, std::vector<std::uint8_t>(80, 7), "table", "-"}};
  return config;
}

int answers_of(NodeSetup& setup) {
  int count = 0;
  for (CanFrame out; setup.next_frame(out); ++count)
    require((out.id == 0x601 || out.id == 0) && !foreign_form(out), "a request to the node");
  return count;
}

void bring_up(fuzz::Bytes& in) {
  const NodeSetup::Config config = setup_of_three_steps();
  std::int64_t now_ns = 0;
  NodeSetup setup(config, now_ns);
  while (!in.empty()) {
    const bool finished = setup.finished();
    CanFrame frame = frame_of(in);
    const unsigned step = frame.data[4] >> 6;
    if (frame.id == 0x581 && frame.size == 8)
      name_object(frame, step == 3 ? config.signature.key : config.steps[step].key);
    setup.receive(frame, now_ns += 1000);
    require(setup.finished() == finished || !foreign_form(frame), "frames of another form say nothing");
    require(answers_of(setup) <= 128, "a bounded answer to one frame");
  }
  for (int i = 0; i < 40 && !setup.finished(); ++i) {
    setup.poll(now_ns += config.sdo_timeout_ns);
    answers_of(setup);
  }
  require(setup.finished(), "an end when the node is silent");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes in(data, size);
  const std::uint8_t who = in.byte();
  if (who % 4 == 1)
    transfer(in);
  else if (who % 4 == 2)
    bring_up(in);
  else
    Tick().run(in);
  return 0;
}

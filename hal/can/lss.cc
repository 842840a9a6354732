#include "hal/can/lss.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "core/check.h"

namespace trn {

namespace {

constexpr int kLssParts = 4, kLssNodeIdMax = 127;
constexpr std::int64_t kLssLook_ns = 1'000'000;

// CiA 305, table 1; index 5 is reserved
constexpr std::pair<int, int> kBitRates[] = {{1'000'000, 0}, {800'000, 1}, {500'000, 2}, {250'000, 3},
                                             {125'000, 4},   {50'000, 6},  {20'000, 7},  {10'000, 8}};

}  // namespace

std::string to_string(const LssIdentity& identity) {
  return fmt::format("vendor 0x{:X} product 0x{:X} revision 0x{:X} serial 0x{:X}", identity[0], identity[1],
                     identity[2], identity[3]);
}

std::optional<int> lss_bit_rate_index(int bitrate) {
  for (const auto& [rate, index] : kBitRates)
    if (rate == bitrate) return index;
  return std::nullopt;
}

std::string lss_bit_rates() {
  std::string out;
  for (const auto& [rate, index] : kBitRates) out += fmt::format("{}{}", out.empty() ? "" : ", ", rate);
  return out;
}

void LssMaster::begin(Service service) {
  service_ = service;
  state_ = State::kBusy;
  error_.clear();
  out_.clear();
  expected_ = 0;
  answered_ = false;
  answers_ = wrong_size_ = 0;
}

// A command, its value in the next bytes, the rest 0
void LssMaster::put(std::uint8_t command, std::uint64_t value, std::int64_t now_ns) {
  std::array<std::uint8_t, 8> bytes{};
  bytes[0] = command;
  put_le(bytes.data() + 1, 7, value);
  out_.push_back(make_frame(lss::kToNode, bytes));
  deadline_ns_ = now_ns + timeout_ns_;
}

void LssMaster::leave(std::int64_t now_ns) {
  begin(Service::kLeave);
  put(lss::kSwitchAll, lss::kWaiting, now_ns);
}

void LssMaster::select(const LssIdentity& identity, std::int64_t now_ns) {
  begin(Service::kSelect);
  identity_ = identity;
  // Whoever was selected before must not hear what follows.
  put(lss::kSwitchAll, lss::kWaiting, now_ns);
  for (std::size_t i = 0; i < kLssParts; ++i)
    put(static_cast<std::uint8_t>(lss::kSelectVendor + i), identity[i], now_ns);
  expected_ = lss::kSelected;
}

void LssMaster::ask_node_id(std::int64_t now_ns) {
  begin(Service::kAsk);
  put(expected_ = lss::kAskNodeId, 0, now_ns);
}

void LssMaster::set_node_id(int id, std::int64_t now_ns) {
  begin(Service::kSetId);
  asked_ = id;
  put(expected_ = lss::kSetNodeId, static_cast<std::uint64_t>(id), now_ns);
}

void LssMaster::set_bit_rate(int index, std::int64_t now_ns) {
  begin(Service::kSetRate);
  // Table 0 is the standard's.
  put(expected_ = lss::kSetBitTiming, static_cast<std::uint64_t>(index) << 8, now_ns);
}

void LssMaster::store(std::int64_t now_ns) {
  begin(Service::kStore);
  put(expected_ = lss::kStore, 0, now_ns);
}

// CiA 305, 6.10: bit by bit from the highest. Nodes whose bits above are the same, and this one 0, answer,
// all with the same frame.
void LssMaster::find(std::int64_t now_ns) {
  begin(Service::kFind);
  identity_ = {};
  put(lss::kSwitchAll, lss::kWaiting, now_ns);
  part_ = -1;
  scan(now_ns);
}

void LssMaster::scan(std::int64_t now_ns) {
  answered_ = false;
  expected_ = lss::kFound;
  const bool first = part_ < 0;
  const auto part = static_cast<std::uint64_t>(first ? 0 : part_);
  // With bit 0 looked at, the next question is whether all bits are right; then the nodes go on to the next
  // part.
  const bool whole = !first && bit_ < 0;
  const std::uint64_t next = whole ? (part + 1) % kLssParts : part;
  const std::uint64_t checked = first ? lss::kScanAll : static_cast<std::uint64_t>(std::max(bit_, 0));
  const std::uint64_t number = first ? 0 : identity_[part];
  put(lss::kFastScan, number | checked << 32 | part << 40 | next << 48, now_ns);
}

void LssMaster::scanned(bool answered, std::int64_t now_ns) {
  if (part_ < 0) {
    if (!answered && wrong_size_ != 0) return fail_silent();
    if (!answered)
      return fail(
          "no node without a node id answers; one that has an id is selected by its identity. Check its "
          "supply, the cable and the bit rate, and whether it knows LSS at all");
    part_ = 0;
    bit_ = 31;
    return scan(now_ns);
  }
  const auto part = static_cast<std::size_t>(part_);
  TRN_CHECK(part < kLssParts);
  if (bit_ >= 0) {
    if (!answered) identity_[part] |= std::uint32_t{1} << bit_;
    --bit_;
    return scan(now_ns);
  }
  if (!answered)
    return fail(
        fmt::format("nobody has the identity that the answers came to ({}); try again, with a longer "
                    "--timeout",
                    to_string(identity_)));
  bit_ = 31;
  if (++part_ < kLssParts) return scan(now_ns);
  state_ = State::kDone;
}

void LssMaster::receive(const CanFrame& frame, std::int64_t now_ns) {
  if (state_ != State::kBusy || frame.error || frame.remote || frame.extended) return;
  if (frame.id != lss::kToMaster || frame.size == 0 || frame.data[0] != expected_ || expected_ == 0) return;
  if (frame.size != 8) {
    wrong_size_ = frame.size;
    return;
  }
  // Of a search, several nodes may answer with the same frame at times of their own: it waits for the last.
  if (service_ == Service::kFind) {
    answered_ = true;
    return poll(now_ns);
  }
  if (service_ != Service::kAsk) return judge(frame);
  ++answers_;
  node_id_ = frame.data[1];
  poll(now_ns);
}

void LssMaster::judge(const CanFrame& frame) {
  const int code = frame.data[1];
  state_ = State::kDone;
  if (service_ == Service::kSelect || code == 0) return;
  const std::string own = code == 255 ? fmt::format(" (its maker's error {})", frame.data[2]) : "";
  if (service_ == Service::kSetId)
    fail(fmt::format("the node refuses node id {}{}: 1 to 127 are legal, and 255 for none", asked_, own));
  else if (service_ == Service::kSetRate)
    fail(fmt::format("the node does not know this bit rate{}; see BaudRate_... in its EDS", own));
  else
    fail(code == 1
             ? "the node cannot store by LSS; store its parameters by 0x1010 instead (trunnion can store)"
             : fmt::format("the node could not store (error {}){}", code, own));
}

// Nobody has set anything yet, so that two nodes of one serial number (often 0) get no common node id.
void LssMaster::judge_node_id() {
  if (answers_ == 0) return fail_silent();
  if (answers_ > 1)
    return fail(fmt::format(
        "{} answers came where one node is selected: several nodes have the same identity, often the serial "
        "number 0. Connect them one at a time; if there is only one, try again",
        answers_));
  const bool legal = (node_id_ >= 1 && node_id_ <= kLssNodeIdMax) || node_id_ == lss::kNoNodeId;
  if (!legal)
    return fail(
        fmt::format("the node says that its node id is {}; legal are 1 to 127, and 255 for none. "
                    "Switch it off and on, and begin anew",
                    node_id_));
  state_ = State::kDone;
}

void LssMaster::fail_silent() {
  if (wrong_size_ != 0)
    return fail(
        fmt::format("an answer of {} bytes came, where 8 are right (CiA 305). Check whether another "
                    "device sends with the identifier 0x{:X}",
                    wrong_size_, lss::kToMaster));
  fail(
      "the node that was selected is silent now; check its supply and the cable, and begin anew, with a "
      "longer --timeout");
}

void LssMaster::poll(std::int64_t now_ns) {
  if (state_ != State::kBusy || now_ns < deadline_ns_) return;
  switch (service_) {
    case Service::kLeave:
      state_ = State::kDone;
      return;
    case Service::kFind:
      return scanned(answered_, now_ns);
    case Service::kSelect:
      if (wrong_size_ != 0) return fail_silent();
      return fail(
          fmt::format("no node of {} answers; all four numbers must be right, as on its label or in 0x1018. "
                      "Check the bit rate, and whether it knows LSS at all",
                      to_string(identity_)));
    case Service::kAsk:
      return judge_node_id();
    case Service::kSetId:
    case Service::kSetRate:
    case Service::kStore:
      return fail_silent();
  }
}

bool LssMaster::next_frame(CanFrame& frame) {
  if (out_.empty()) return false;
  frame = out_.front();
  out_.pop_front();
  return true;
}

void LssMaster::fail(const std::string& what) {
  error_ = what;
  state_ = State::kFailed;
}

std::string run_lss(CanEndpoint& bus, LssMaster& master) {
  std::array<CanFrame, 64> in;
  CanFrame frame;
  bool waits = master.next_frame(frame);
  while (master.state() == LssMaster::State::kBusy) {
    while (waits && bus.send({&frame, 1}) == 1) waits = master.next_frame(frame);
    bus.wait(kLssLook_ns);
    const int count = bus.receive(in);
    for (int i = 0; i < count; ++i) master.receive(in[static_cast<std::size_t>(i)], bus.now_ns());
    master.poll(bus.now_ns());
    if (!waits) waits = master.next_frame(frame);
  }
  return master.error();
}

}  // namespace trn

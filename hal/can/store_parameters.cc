#include "hal/can/store_parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "hal/can/cia402.h"
#include "hal/can/frame.h"
#include "hal/can/sdo.h"
#include "hal/can/sdo_talk.h"

namespace trn {

namespace {

constexpr std::int64_t kStoring_ns = 20'000'000'000;
constexpr std::uint32_t kSave = 0x65766173;  // "save", the low byte first

class StoringNode {
 public:
  StoringNode(CanEndpoint& bus, int id, std::int64_t timeout_ns) : talk_(bus, id, timeout_ns), id_(id) {}

  /// Nothing: the node does not have it. A node that refuses to tell may have it, and is not understood.
  std::optional<std::uint64_t> read(ObjectKey key, std::size_t size) {
    try {
      const auto data = talk_.read(key);
      if (!data && absent()) return std::nullopt;
      if (!data) fail(key, "cannot be read: " + refusal());
      if (data->size() != size)
        fail(key,
             fmt::format("came with {} bytes, where {} are right; nothing is stored", data->size(), size));
      return get_le(data->data(), static_cast<int>(size));
    } catch (const SdoSilence& silence) {
      throw StoreError(silence.what());
    }
  }
  bool write(ObjectKey key, std::uint64_t value, std::size_t size, std::int64_t timeout_ns) {
    try {
      return talk_.write(key, value, size, timeout_ns);
    } catch (const SdoSilence& silence) {
      throw StoreError(silence.what());
    }
  }
  bool absent() const { return talk_.absent(); }
  std::string refusal() const {
    return fmt::format("SDO abort 0x{:08X} ({})", talk_.code(), sdo_abort_text(talk_.code()));
  }
  int id() const { return id_; }
  [[noreturn]] void fail(ObjectKey key, const std::string& what) const {
    throw StoreError(fmt::format("node {}: {} {}", id_, to_string(key), what));
  }

 private:
  SdoTalk talk_;
  int id_;
};

// A drive with power may go off while it stores, and some do.
void refuse_under_power(StoringNode& node) {
  constexpr ObjectKey kStatus{0x6041, 0};
  const auto word = node.read(kStatus, 2);
  if (!word) return;  // no drive
  const Cia402State state = cia402_state(static_cast<std::uint16_t>(*word));
  if (state == Cia402State::kOperationEnabled || state == Cia402State::kQuickStopActive ||
      state == Cia402State::kFaultReactionActive)
    node.fail(kStatus, "says that the drive has power on its motor; switch it off first (trunnion estop)");
}

// In this order `signature_step` asks for them; the first one that a drive has is what it goes by.
void take_back_signature(StoringNode& node, std::vector<std::string>& done) {
  bool any = false;
  constexpr std::pair<ObjectKey, std::size_t> kSignatures[] = {
      {{0x1016, 1}, 4}, {{0x100C, 0}, 2}, {{0x1006, 0}, 4}};
  for (const auto& [key, size] : kSignatures) {
    const auto value = node.read(key, size);
    if (!value) continue;
    any = true;
    if (*value == 0) continue;
    if (!node.write(key, 0, size, kStoring_ns))
      node.fail(
          key,
          fmt::format("cannot be taken back: {}. Stored, it would hide that the drive was restarted; store "
                      "the application's part alone (trunnion can store {} application)",
                      node.refusal(), node.id()));
    done.push_back(fmt::format("{} was {}, and is 0 now", to_string(key), *value));
  }
  if (!any)
    node.fail(
        {0x1016, 1},
        fmt::format("is not there, nor 0x100C, nor 0x1006: with its communication stored, nothing would "
                    "tell that this drive was restarted; store the application's part alone (trunnion can "
                    "store {} application)",
                    node.id()));
}

}  // namespace

std::vector<std::string> store_parameters(CanEndpoint& bus, int id, StoredPart part,
                                          std::int64_t timeout_ns) {
  StoringNode node(bus, id, timeout_ns);
  const ObjectKey key{0x1010, static_cast<std::uint8_t>(part)};
  refuse_under_power(node);
  const auto can = node.read(key, 4);
  if (!can && part != StoredPart::kAll)
    node.fail(
        key, fmt::format("is not there: the node cannot store this part alone; try trunnion can store {} all",
                         id));
  if (!can) node.fail(key, "is not there: the node cannot store, see its manual");
  // Bit 0: it stores when it is told, bit 1: by itself (CiA 301, 7.5.2.13).
  if ((*can & 1) == 0)
    node.fail(
        key, fmt::format("is {}: the node {}", *can,
                         *can & 2 ? "stores by itself, there is nothing to do" : "does not store this part"));
  std::vector<std::string> done;
  if (part != StoredPart::kApplication) take_back_signature(node, done);
  if (!node.write(key, kSave, 4, std::max(timeout_ns, kStoring_ns)))
    node.fail(key, fmt::format("was told to save, and refuses: {}", node.refusal()));
  done.push_back(fmt::format("{} is told to save, and has done so", to_string(key)));
  return done;
}

}  // namespace trn

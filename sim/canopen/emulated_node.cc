#include "sim/canopen/emulated_node.h"

#include <algorithm>
#include <utility>

#include "hal/can/sdo.h"

namespace trn {

namespace {
constexpr std::uint16_t kHeartbeatCode = 0x8130, kSyncCode = 0x8700, kPdoLengthCode = 0x8210;
}  // namespace

EmulatedNode::EmulatedNode(const Config& config)
    : config_(config),
      store_(config.dictionary, config.fd ? 64 : 8),
      drive_(config.drive, store_),
      sdo_(config.id, store_, [](ObjectKey) {}),
      lss_(lss_config()) {
  store_.set_pdo_habits(config.pdo_habits);
  store_.set_stores(config.stores);
}

EmulatedLss::Config EmulatedNode::lss_config() const {
  EmulatedLss::Config out;
  for (std::uint8_t i = 0; i < out.identity.size(); ++i)
    out.identity[i] = static_cast<std::uint32_t>(store_.integer({0x1018, static_cast<std::uint8_t>(i + 1)}));
  if (config_.serial != 0) out.identity[3] = config_.serial;
  out.node_id = config_.without_id ? lss::kNoNodeId : config_.id;
  out.bitrate = -1;
  out.stores = config_.stores;
  return out;
}

// Identifiers of the predefined connection set follow from the id (CiA 301, 7.3.3).
void EmulatedNode::take_id(int id) {
  if (id == id_) return;
  id_ = id;
  sdo_.set_node(id);
  if (id != lss::kNoNodeId && !(id == config_.id && !renamed_)) {
    store_.take_defaults(load_eds(config_.dictionary.file, id));
    renamed_ = true;
  }
}

// At another bit rate it understands nothing, and nobody understands it.
bool EmulatedNode::is_deaf() const {
  return bitrate_ >= 0 && lss_bit_rate_index(config_.bitrate) != bitrate_;
}

void EmulatedNode::put(const CanFrame& frame, std::int64_t now_ns) {
  if (silent_ || is_deaf()) return;
  const std::int64_t time_ns = now_ns + config_.answer_delay_ns + slow_ns_;
  // slower than before: the order of the controller's queue stays
  out_.push(frame, out_.empty() ? time_ns : std::max(time_ns, out_.back_time_ns()));
}

bool EmulatedNode::next_frame(std::int64_t now_ns, CanFrame& frame) {
  if (out_.empty() || out_.front_time_ns() > now_ns) return false;
  frame = out_.front();
  out_.pop();
  return true;
}

void EmulatedNode::boot(std::int64_t now_ns, bool power) {
  // A reset of communication keeps what the drive itself was set to; power loses all that was not stored.
  if (power) {
    lss_.power_cycle();
    bitrate_ = lss_.bitrate();
  }
  take_id(lss_.node_id());
  store_.restore(!power);
  if (config_.serial != 0) store_.set({0x1018, 4}, config_.serial);
  if (power) drive_.power_cycle();
  sdo_.reset();
  out_.clear();
  rpdos_.clear();
  tpdos_.clear();
  nmt_ = NmtState::kPreOperational;
  master_known_ = guarded_ = false;
  guard_toggle_ = false;
  next_beat_ns_ = now_ns;
  last_step_ns_ = last_sync_ns_ = now_ns;
  booted_ = true;
  // Without an id it has nothing to boot up with: it waits for one (CiA 305, 5).
  if (id_ == lss::kNoNodeId) return;
  put(heartbeat_frame(id_, NmtState::kBootUp), now_ns);
}

void EmulatedNode::obey_nmt(NmtCommand command, std::int64_t now_ns) {
  if (id_ == lss::kNoNodeId && command != NmtCommand::kResetNode &&
      command != NmtCommand::kResetCommunication)
    return;
  switch (command) {
    case NmtCommand::kStart:
      // The mapping is taken over on the way into Operational, once: what is written later does not act
      // before.
      if (nmt_ != NmtState::kOperational) map_pdos();
      nmt_ = NmtState::kOperational;
      last_sync_ns_ = now_ns;
      break;
    case NmtCommand::kStop:
      nmt_ = NmtState::kStopped;
      drive_.lose_connection(kHeartbeatCode);
      break;
    case NmtCommand::kPreOperational:
      // Setpoints cannot come any more, so an enabled drive brakes.
      if (nmt_ == NmtState::kOperational) drive_.lose_connection(kHeartbeatCode);
      nmt_ = NmtState::kPreOperational;
      break;
    case NmtCommand::kResetNode:
      return boot(now_ns, true);
    case NmtCommand::kResetCommunication:
      return boot(now_ns, false);
  }
  next_beat_ns_ = std::min(next_beat_ns_, now_ns);  // tell at once
}

EmulatedNode::MappedPdo EmulatedNode::map_pdo(std::uint16_t record) {
  MappedPdo pdo;
  const auto id = static_cast<std::uint32_t>(store_.integer({record, 1}));
  if (!store_.has({record, 1}) || (id & 0x80000000u)) return pdo;
  pdo.id = id & 0x7FF;
  pdo.transmission = static_cast<unsigned>(store_.integer({record, 2})) & 0xFF;
  const auto mapping = static_cast<std::uint16_t>(record + 0x200);
  const std::int64_t count = store_.integer({mapping, 0});
  for (std::int64_t sub = 1; sub <= count; ++sub) {
    const std::int64_t entry = store_.integer({mapping, static_cast<std::uint8_t>(sub)});
    auto* bytes =
        store_.bytes({static_cast<std::uint16_t>(entry >> 16), static_cast<std::uint8_t>(entry >> 8)});
    const unsigned size = static_cast<unsigned>(entry & 0xFF) / 8;
    const bool gap = (entry >> 16) < 0x20;  // a place that nothing stands for (CiA 301, 7.4.7.1)
    if (gap) bytes = nullptr;
    if (gap && pdo.size + size <= (config_.fd ? 64u : 8u)) {
      pdo.fields.emplace_back(nullptr, size);
      pdo.size += size;
    }
    if (!bytes || bytes->size() != size || pdo.size + size > (config_.fd ? 64 : 8)) continue;
    pdo.fields.emplace_back(bytes, size);
    pdo.size += size;
  }
  return pdo;
}

void EmulatedNode::map_pdos() {
  rpdos_.clear();
  tpdos_.clear();
  for (std::uint16_t i = 0; i < 4; ++i) {
    rpdos_.push_back(map_pdo(static_cast<std::uint16_t>(0x1400 + i)));
    tpdos_.push_back(map_pdo(static_cast<std::uint16_t>(0x1800 + i)));
  }
}

void EmulatedNode::receive(const CanFrame& frame, std::int64_t now_ns) {
  if (frame.error || frame.extended || !booted_ || is_deaf()) return;
  if (frame.id == lss::kToNode) {
    for (lss_.receive(frame, id_, answers_); !answers_.empty(); answers_.pop()) put(answers_.front(), now_ns);
    if (lss_.left_configuration() && id_ == lss::kNoNodeId && lss_.node_id() != id_) boot(now_ns, false);
    return;
  }
  const auto id = static_cast<unsigned>(id_);
  if (id_ == lss::kNoNodeId && frame.id != cob::kNmt) return;
  if (frame.id == cob::kNmt && frame.size >= 2 && (frame.data[1] == 0 || frame.data[1] == id))
    return obey_nmt(static_cast<NmtCommand>(frame.data[0]), now_ns);
  if (frame.id == cob::kGuard + id && frame.remote) {
    // A node that beats does not answer to guarding (CiA 301, 7.2.8.2.2.3).
    if (store_.integer({0x1017, 0}) > 0) return;
    guard_seen_ns_ = now_ns;
    guarded_ = true;
    if (no_heartbeat_) return;
    CanFrame answer = heartbeat_frame(id_, nmt_);
    // The toggle bit of node guarding, by which the master tells that an answer is a new one (CiA 301).
    answer.data[0] |= guard_toggle_ ? 0x80 : 0;
    guard_toggle_ = !guard_toggle_;
    return put(answer, now_ns);
  }
  const auto consumed = static_cast<std::uint32_t>(store_.integer({0x1016, 1}));
  if (consumed != 0 && frame.id == cob::kGuard + (consumed >> 16 & 0x7Fu)) {
    master_seen_ns_ = now_ns;
    master_known_ = true;
  }
  // Stopped, a node answers to network management and guarding only; SDO needs Pre-operational, PDOs
  // Operational.
  if (nmt_ == NmtState::kStopped) return;
  for (sdo_.receive(frame, answers_); !answers_.empty(); answers_.pop()) put(answers_.front(), now_ns);
  if (nmt_ != NmtState::kOperational) return;
  const bool counts =
      store_.integer({0x1019, 0}) > 1;  // a SYNC of another length is none (CiA 301, 7.5.2.22)
  if (frame.id == cob::kSync && frame.size == (counts ? 1 : 0)) on_sync(now_ns);
  take_rpdo(frame);
}

void EmulatedNode::take_rpdo(const CanFrame& frame) {
  for (MappedPdo& pdo : rpdos_) {
    if (pdo.id == 0 || frame.id != pdo.id) continue;
    // A PDO that is too short would leave half of a setpoint from before.
    if (frame.size < pdo.size) {
      drive_.fail(kPdoLengthCode);
      continue;
    }
    pdo.data = frame.data;
    // Kept until SYNC: all drives of the bus take their setpoints in the same moment.
    pdo.pending = true;
  }
}

// Synchronous PDOs: what came since the last SYNC acts now, what is measured now goes out (CiA 301, 7.2.2.2)
void EmulatedNode::on_sync(std::int64_t now_ns) {
  last_sync_ns_ = now_ns;
  for (MappedPdo& pdo : rpdos_) {
    if (!std::exchange(pdo.pending, false)) continue;
    unsigned at = 0;
    for (const auto& [bytes, size] : pdo.fields) {
      if (bytes) std::copy_n(pdo.data.begin() + at, size, bytes->begin());
      at += size;
    }
  }
  step_drive(now_ns);
  // Transmission types 1 to 240: with every so many SYNC frames. Others are no business of SYNC.
  for (MappedPdo& pdo : tpdos_)
    if (pdo.id != 0 && pdo.transmission >= 1 && pdo.transmission <= 240 && ++pdo.count >= pdo.transmission)
      send_tpdo(pdo, now_ns);
}

void EmulatedNode::send_tpdo(MappedPdo& pdo, std::int64_t now_ns) {
  pdo.count = 0;
  CanFrame frame;
  frame.id = pdo.id;
  for (const auto& [bytes, size] : pdo.fields) {
    if (bytes) std::copy_n(bytes->begin(), size, frame.data.begin() + frame.size);
    frame.size = static_cast<std::uint8_t>(frame.size + size);
  }
  // The position lies behind the status word in the first PDO.
  if (lie_ != 0 && frame.size >= 6)
    put_le(frame.data.data() + 2, 4,
           static_cast<std::uint64_t>(get_le_signed(frame.data.data() + 2, 4) + lie_));
  frame.fd = config_.fd;
  if (frame.fd) frame.size = static_cast<std::uint8_t>(fd_size(frame.size));
  if (short_ && frame.size > 0) frame.size = static_cast<std::uint8_t>(std::min(frame.size - 1, 8));
  // Each frame waits until the next one comes, so that every two go in the wrong order.
  if (reorder_) std::swap(frame, held_back_);
  if (reorder_ && frame.id == 0) return;
  put(frame, now_ns);
  if (duplicate_) put(frame, now_ns);
}

void EmulatedNode::step_drive(std::int64_t now_ns) {
  last_step_ns_ = now_ns;
  drive_.step();
  const int code = drive_.take_emergency();
  if (code < 0) return;
  const auto error_register = static_cast<std::uint8_t>(code != 0 ? 0x01 : 0x00);
  store_.set({0x1001, 0}, error_register);
  store_.set({0x603F, 0}, code);
  put(make_frame(cob::kEmergency + static_cast<unsigned>(id_),
                 {static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(code >> 8), error_register, 0, 0,
                  0, 0, 0}),
      now_ns);
}

void EmulatedNode::watch_master(std::int64_t now_ns) {
  const auto consumed = static_cast<std::uint32_t>(store_.integer({0x1016, 1}));
  const std::int64_t limit_ns = 1'000'000LL * (consumed & 0xFFFF);
  const bool late = master_known_ && limit_ns > 0 && now_ns - master_seen_ns_ > limit_ns;
  // Life guarding begins with the first question (CiA 301, 7.2.8.2.2.2).
  const std::int64_t life_ns = 1'000'000LL * store_.integer({0x100C, 0}) * store_.integer({0x100D, 0});
  const bool unasked = guarded_ && life_ns > 0 && now_ns - guard_seen_ns_ > life_ns;
  if (!late && !unasked) return;
  if (late) master_known_ = false;
  if (unasked) guarded_ = false;
  drive_.lose_connection(kHeartbeatCode);
}

void EmulatedNode::beat(std::int64_t now_ns) {
  const std::int64_t pause_ns = 1'000'000LL * store_.integer({0x1017, 0});
  if (pause_ns <= 0 || now_ns < next_beat_ns_) return;
  next_beat_ns_ = now_ns + pause_ns;
  if (!no_heartbeat_) put(heartbeat_frame(id_, nmt_), now_ns);
}

// The drive's clock runs on when SYNC stays away: it brakes by itself.
void EmulatedNode::poll(std::int64_t now_ns) {
  if (!booted_) boot(now_ns, true);
  if (id_ == lss::kNoNodeId) return;
  beat(now_ns);
  watch_master(now_ns);
  const auto period_ns = static_cast<std::int64_t>(config_.drive.period_s * 1e9);
  if (now_ns - last_sync_ns_ > config_.sync_periods_max * period_ns) drive_.lose_connection(kSyncCode);
  // Two periods of grace: SYNC that is a little late must not make the drive step twice.
  while (now_ns - last_step_ns_ > 2 * period_ns) {
    const std::int64_t next_ns = last_step_ns_ + period_ns;
    step_drive(now_ns);
    last_step_ns_ = next_ns;
    if (now_ns - last_step_ns_ > 1000 * period_ns) last_step_ns_ = now_ns;  // long asleep
  }
}

std::int32_t EmulatedNode::target_counts() const {
  return static_cast<std::int32_t>(store_.integer({0x607A, 0}));
}

void EmulatedNode::trouble(Trouble kind, std::int64_t value, std::int64_t now_ns) {
  const auto code = static_cast<std::uint16_t>(value);
  switch (kind) {
    case Trouble::kSilent:
      silent_ = value != 0;
      return out_.clear();
    case Trouble::kReset:
      return boot(now_ns, true);
    case Trouble::kEmergency:
      return put(make_frame(cob::kEmergency + static_cast<unsigned>(id_),
                            {static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(code >> 8), 1, 0, 0,
                             0, 0, 0}),
                 now_ns);
    case Trouble::kFault:
      return drive_.fail(code);
    case Trouble::kNoHeartbeat:
      no_heartbeat_ = value != 0;
      return;
    case Trouble::kHeartbeatLate:
      next_beat_ns_ += 1000 * value;
      return;
    case Trouble::kDrop:
      return drive_.drop();
    case Trouble::kDuplicate:
      duplicate_ = value != 0;
      return;
    case Trouble::kReorder:
      reorder_ = value != 0;
      held_back_ = CanFrame{};
      return;
    case Trouble::kShortPdo:
      short_ = value != 0;
      return;
    case Trouble::kRefuse:
      return sdo_.refuse(code, value != 0 ? sdo_abort::kGeneral : 0);
    case Trouble::kSlow:
      slow_ns_ = 1000 * value;
      return;
    case Trouble::kLie:
      lie_ = value;
      return;
    case Trouble::kIgnore:
      return drive_.ignore_targets(value != 0);
    case Trouble::kQuietFault:
      drive_.keep_quiet();
      return drive_.fail(code);
    case Trouble::kHeld:
      return drive_.joint().set_stuck(value != 0);
    case Trouble::kSto:
      return drive_.set_sto(value != 0);
    case Trouble::kInputs:
      return drive_.set_inputs(static_cast<std::uint32_t>(value));
    case Trouble::kPreOperational:
      return obey_nmt(NmtCommand::kPreOperational, now_ns);
  }
}

}  // namespace trn

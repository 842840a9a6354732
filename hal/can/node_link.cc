#include "hal/can/node_link.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "hal/can/cia402.h"

namespace trn {

namespace {
constexpr ObjectKey kControlword{0x6040, 0}, kStatusword{0x6041, 0}, kModes{0x6060, 0},
    kModesDisplay{0x6061, 0}, kActualPosition{0x6064, 0}, kTargetPosition{0x607A, 0},
    kTargetVelocity{0x60FF, 0}, kDigitalInputs{0x60FD, 0}, kInterpolationData{0x60C1, 1}, kTorque{0x6077, 0},
    kErrorCode{0x603F, 0}, kVelocityOffset{0x60B1, 0}, kTorqueOffset{0x60B2, 0}, kTargetTorque{0x6071, 0},
    kTouchFunction{0x60B8, 0}, kTouchStatus{0x60B9, 0}, kTouchRise{0x60BA, 0}, kTouchFall{0x60BB, 0},
    kDigitalOutputs{0x60FE, 1};

// An answer comes within some periods; a drive that is silent for longer is asked again.
constexpr std::uint32_t kSdoPeriodsMax = 50;
constexpr std::uint32_t kDisplayPeriods = 50;   // between two looks at 0x6061 by SDO
constexpr std::uint32_t kBelievedPeriods = 10;  // until a mode that nobody shows counts as taken
}  // namespace

NodeLink::Place NodeLink::place(const std::vector<Pdo>& pdos, ObjectKey key) {
  Place out;
  PdoField field;
  if (!find_field(pdos, key, out.pdo, field)) return out;
  out.byte = field.byte;
  out.bits = field.bits;
  return out;
}

NodeLink::NodeLink(const Config& config)
    : config_(config),
      axis_(config.axis),
      brake_(config.brake),
      sdo_(config.id, kSdoPeriodsMax),
      status_(place(config.tpdos, kStatusword)),
      position_(place(config.tpdos, kActualPosition)),
      mode_display_(place(config.tpdos, kModesDisplay)),
      digital_inputs_(place(config.tpdos, kDigitalInputs)),
      touch_status_(place(config.tpdos, kTouchStatus)),
      touch_rise_(place(config.tpdos, kTouchRise)),
      touch_fall_(place(config.tpdos, kTouchFall)),
      torque_(place(config.tpdos, kTorque)),
      control_(place(config.rpdos, kControlword)),
      target_(place(config.rpdos, config.axis.mode == Cia402Mode::kInterpolatedPosition ? kInterpolationData
                                                                                        : kTargetPosition)),
      velocity_(place(config.rpdos, kTargetVelocity)),
      mode_(place(config.rpdos, kModes)),
      touch_function_(place(config.rpdos, kTouchFunction)),
      velocity_offset_(place(config.rpdos, kVelocityOffset)),
      torque_offset_(place(config.rpdos, kTorqueOffset)),
      torque_target_(place(config.rpdos, kTargetTorque)),
      digital_outputs_(place(config.rpdos, kDigitalOutputs)),
      shared_(std::make_unique<Shared>()) {}

void NodeLink::receive(const CanFrame& frame) TRN_RT {
  if (hears_past_ || frame.error || frame.remote || frame.extended) return;
  const auto id = static_cast<unsigned>(config_.id);
  if (frame.id == cob::kGuard + id) return take_state(frame);
  if (frame.id == cob::kSdoAnswer + id) return sdo_.receive(frame);
  if (frame.id == cob::kEmergency + id) return take_emergency(frame);
  for (std::size_t i = 0; i < config_.tpdos.size(); ++i)
    if (frame.id == config_.tpdos[i].id) return take_pdo(i, frame);
}

void NodeLink::take_pdo(std::size_t number, const CanFrame& frame) TRN_RT {
  TRN_CHECK(number < config_.tpdos.size());
  if (frame.size != config_.tpdos[number].frame_size()) {
    shared_->wrong_length.fetch_add(1, std::memory_order_relaxed);
    return;  // not the mapping that was asked for: no measurement
  }
  const auto value = [&](const Place& at)
                         TRN_RT { return get_le_signed(frame.data.data() + at.byte, at.bits / 8); };
  const int pdo = static_cast<int>(number);
  if (status_.pdo == pdo) input_.statusword = static_cast<std::uint16_t>(value(status_));
  if (position_.pdo == pdo) input_.position = static_cast<std::int32_t>(value(position_));
  if (mode_display_.pdo == pdo) input_.mode = static_cast<std::int8_t>(value(mode_display_));
  if (digital_inputs_.pdo == pdo) {
    inputs_ = static_cast<unsigned>(value(digital_inputs_));
    inputs_heard_ = true;
  }
  if (torque_.pdo == pdo) {
    torque_now_ = static_cast<std::int16_t>(value(torque_));
    shared_->torque.store(torque_now_, std::memory_order_relaxed);
  }
  if (touch_status_.pdo == pdo) touch_.take_status(static_cast<std::uint16_t>(value(touch_status_)));
  if (touch_rise_.pdo == pdo) touch_.take_position(true, static_cast<std::int32_t>(value(touch_rise_)));
  if (touch_fall_.pdo == pdo) touch_.take_position(false, static_cast<std::int32_t>(value(touch_fall_)));
  // Only the PDO with the position counts as feedback. Slow ones would keep a drive alive whose position does
  // not come any more.
  fresh_ |= position_.pdo == pdo;
}

void NodeLink::take_state(const CanFrame& frame) TRN_RT {
  if (frame.size < 1) return;
  const NmtState state = nmt_state(frame.data[0]);
  shared_->nmt.store(static_cast<std::uint8_t>(state), std::memory_order_relaxed);
  // Any message of its state shows that the node is alive: heartbeat, answer to guarding or boot-up.
  since_heartbeat_ = 0;
  if (config_.watch.guard_periods > 0) {
    const bool toggle = frame.data[0] & 0x80;
    if (guard_known_ && toggle == guard_toggle_)
      shared_->guard_toggle_errors.fetch_add(1, std::memory_order_relaxed);
    guard_toggle_ = toggle;
  }
  guard_known_ = state != NmtState::kBootUp;  // the first answer after it says what the next must differ from
  // During its own set-up a node boots and is not operational; none of that is a fault then.
  if (!was_watched_) return;
  if (state == NmtState::kBootUp) {
    // It counts from anywhere after a restart. What it says next may be far from the last position without
    // being impossible.
    axis_.forget_position();
    fail(Fault::kDriveRestarted, true);
  } else if (state != NmtState::kOperational) {
    fail(Fault::kDriveDropped, true);
  }
}

// The fault that follows in the statusword says more; a drive that goes on working only has something to
// tell.
void NodeLink::take_emergency(const CanFrame& frame) TRN_RT {
  if (frame.size < 3) return;
  const auto code = static_cast<std::uint16_t>(get_le(frame.data.data(), 2));
  if (code != 0) shared_->emergency.store(code, std::memory_order_relaxed);
  shared_->error_register.store(frame.data[2], std::memory_order_relaxed);
  if (code != 0 && was_watched_) fail(Fault::kDriveWarning, false);
}

void NodeLink::fail(Fault fault, bool needs_setup) TRN_RT {
  TRN_CHECK(fault != Fault::kOk);
  if (needs_setup) shared_->needs_setup.store(true, std::memory_order_relaxed);
  fault_ = worse(fault_, fault);
  if (fault_info(fault).reaction == Reaction::kQuickStop) axis_.fail(fault);
}

void NodeLink::lose(Fault fault) TRN_RT {
  fail(fault, true);
  lost_ = true;
}

void NodeLink::reset() TRN_RT {
  fault_ = Fault::kOk;
  lost_ = false;
  missed_ = since_heartbeat_ = 0;
  shared_->emergency.store(0, std::memory_order_relaxed);
  shared_->error_code.store(0, std::memory_order_relaxed);
  axis_.reset();
}

void NodeLink::enable() TRN_RT {
  letting_go_ = false;
  axis_.enable();
}

void NodeLink::disable() TRN_RT {
  letting_go_ = axis_.wanted() && !brake_.holds();
  if (!letting_go_) axis_.disable();
}

// The drive holds the axis until the brake does, and takes it over before the brake lets go.
void NodeLink::step_brake() TRN_RT {
  const Cia402State drive = cia402_state(input_.statusword);
  const bool held =
      !lost_ && (drive == Cia402State::kOperationEnabled || drive == Cia402State::kQuickStopActive ||
                 drive == Cia402State::kFaultReactionActive);
  brake_.step({held, axis_.stands(), axis_.wanted() && !letting_go_});
  shared_->braked.store(brake_.holds(), std::memory_order_relaxed);
  if (!brake_.holds() || !(letting_go_ || axis_.stopping())) return;
  letting_go_ = false;
  if (axis_.stopping())
    axis_.end_stop();
  else
    axis_.disable();
}

bool NodeLink::sto_active() const TRN_RT {
  const StoSign& sign = config_.sto;
  const unsigned bits = sign.in_statusword ? input_.statusword : inputs_;
  return sign.known && ((bits >> sign.bit & 1u) != 0) == sign.when_on;
}

void NodeLink::halt() TRN_RT {
  axis_.quick_stop();
  if (axis_.stopping()) output_.controlword = controlword::kQuickStop;
}

Fault NodeLink::fault() const TRN_RT { return worse(fault_, axis_.fault()); }

DriveState NodeLink::state() const TRN_RT {
  if (lost_) return DriveState::kLost;
  if (!was_watched_) return DriveState::kOff;
  const bool stopped = fault_ != Fault::kOk && fault_info(fault_).reaction == Reaction::kQuickStop;
  // Between brake and drive it is not yet, or no longer, an axis that moves.
  if (axis_.state() == DriveState::kEnabled && letting_go_) return DriveState::kQuickStop;
  if (axis_.state() == DriveState::kEnabled && !brake_.open()) return DriveState::kStarting;
  // A drive that was stopped for a fault of the link stands switched off. It must not look like one that
  // nobody has asked for.
  return stopped && axis_.state() == DriveState::kOff ? DriveState::kFault : axis_.state();
}

// A set-up may begin and end between two ticks, if the tick is late. Then its frames still wait in the queue,
// and "pre-operational" in one of them is no fault.
void NodeLink::begin_period() TRN_RT {
  was_watched_ = shared_->watched.load(std::memory_order_acquire);
  const std::uint32_t setups = shared_->setups.load(std::memory_order_acquire);
  hears_past_ = setups != setups_seen_;
  if (!hears_past_) return;
  setups_seen_ = setups;
  missed_ = since_heartbeat_ = 0;
  input_ = Cia402Axis::Input{};  // what it said before it was set up means nothing any more
  fresh_ = inputs_heard_ = guard_known_ = false;
  told_mode_ = wanted_mode_ = static_cast<std::int8_t>(config_.axis.mode);
  sdo_.forget();
}

void NodeLink::watch() TRN_RT {
  if (shared_->position_lost.exchange(false)) axis_.forget_position();
  const bool misses = !fresh_ && !hears_past_;
  missed_ = misses ? missed_ + 1 : 0;
  if (misses && was_watched_) shared_->missed.fetch_add(1, std::memory_order_relaxed);
  ++since_heartbeat_;
  if (!was_watched_ || lost_) return;
  // With a period of 1 ms and three missed, 3 ms without feedback. A drive that is not heard may still obey,
  // so the master goes on telling it to stop.
  if (missed_ > config_.watch.missed_max) {
    fail(Fault::kDriveLost, true);
    lost_ = true;
  }
  const std::uint32_t pause_max = config_.watch.heartbeat_periods;
  // Feedback without heartbeats is not yet a drive that is lost: its position is known and it can be stopped
  // on its ramp.
  if (pause_max > 0 && since_heartbeat_ > pause_max) fail(Fault::kHeartbeatLost, false);
}

void NodeLink::step(double q, double qd, bool follow) TRN_RT {
  TRN_CHECK(std::isfinite(q) && std::isfinite(qd));
  watch();
  input_.fresh = fresh_;
  input_.sto = sto_active();
  show_mode();
  axis_.step(input_, q, qd, follow && !lost_, output_);
  if (config_.brake.fitted) step_brake();
  fresh_ = false;
  step_sdo();
  shared_->statusword.store(input_.statusword, std::memory_order_relaxed);
  // What it says next is of the quick stop, no longer of the cause.
  const bool ignores = fault() == Fault::kDriveIgnores;
  if (ignores && shared_->fault.load(std::memory_order_relaxed) != Fault::kDriveIgnores)
    shared_->ignoring_statusword.store(input_.statusword, std::memory_order_relaxed);
  shared_->fault.store(fault(), std::memory_order_relaxed);
}

// A drive without a mode display is believed to have taken what it was told, some periods later.
void NodeLink::show_mode() TRN_RT {
  since_mode_ = output_.mode == wanted_mode_ ? since_mode_ + 1 : 0;
  wanted_mode_ = output_.mode;
  const bool told = !config_.mode_by_sdo || told_mode_ == wanted_mode_;
  if (!config_.axis.habits.mode_display && told && since_mode_ >= kBelievedPeriods)
    input_.mode = wanted_mode_;
}

void NodeLink::take_sdo() TRN_RT {
  if (sdo_.state() != TickSdo::State::kDone) return;
  if (sdo_.key() == kModes) told_mode_ = sent_mode_;
  if (sdo_.key() == kModesDisplay) input_.mode = static_cast<std::int8_t>(sdo_.value());
  if (sdo_.key() == kErrorCode)
    shared_->error_code.store(static_cast<std::uint16_t>(sdo_.value()), std::memory_order_relaxed);
}

// What does not go in PDOs, one transfer at a time, the most urgent first.
void NodeLink::step_sdo() TRN_RT {
  const bool faulty = axis_.fault() == Fault::kDriveFault;
  if (faulty && !was_faulty_) asks_error_ = config_.has_error_code;
  was_faulty_ = faulty;
  ++since_display_;
  if (!was_watched_ || lost_) return sdo_.forget();
  if (sdo_.busy()) return;
  take_sdo();
  sdo_.forget();
  if (config_.mode_by_sdo && output_.mode != told_mode_) {
    sent_mode_ = output_.mode;
    return sdo_.write(kModes, static_cast<std::uint8_t>(output_.mode), 1);
  }
  if (asks_error_) {
    asks_error_ = false;
    return sdo_.read(kErrorCode);
  }
  const bool due = input_.mode != output_.mode || since_display_ >= kDisplayPeriods;
  if (!config_.display_by_sdo || !due) return;
  since_display_ = 0;
  sdo_.read(kModesDisplay);
}

void NodeLink::put(const Place& at, std::uint64_t value, Frames& frames) const TRN_RT {
  if (at.pdo < 0) return;
  TRN_CHECK(at.pdo < 4);
  TRN_CHECK(static_cast<std::size_t>(at.byte + at.bits / 8) <= frames[0].data.size());
  put_le(frames[static_cast<std::size_t>(at.pdo)].data.data() + at.byte, at.bits / 8, value);
}

bool NodeLink::force(double& force) const TRN_RT {
  if (torque_.pdo < 0 || config_.axis.torque_units == 0) return false;
  force = torque_now_ / config_.axis.torque_units;
  return true;
}

bool NodeLink::touch_contact() const TRN_RT {
  const bool closed = inputs_ >> config_.touch_input_bit & 1u;
  return touch_.contact_wanted() ? closed || touch_.triggered() : closed && !touch_.triggered();
}

// Slow PDOs of different nodes leave in different periods.
bool NodeLink::is_due(const Pdo& pdo) const TRN_RT {
  TRN_CHECK(pdo.every > 0);
  return (periods_ + static_cast<std::uint32_t>(config_.id)) % static_cast<std::uint32_t>(pdo.every) == 0;
}

int NodeLink::fill(Frames& frames) TRN_RT {
  const std::size_t count = std::min<std::size_t>(config_.rpdos.size(), 4);
  for (std::size_t i = 0; i < count; ++i) {
    frames[i] = CanFrame{};
    frames[i].id = config_.rpdos[i].id;
    frames[i].size = static_cast<std::uint8_t>(config_.rpdos[i].frame_size());
    frames[i].fd = config_.rpdos[i].fd;
  }
  put(control_, output_.controlword, frames);
  put(target_, static_cast<std::uint32_t>(output_.position), frames);
  put(velocity_, static_cast<std::uint32_t>(output_.velocity), frames);
  put(mode_, static_cast<std::uint8_t>(output_.mode), frames);
  put(touch_function_, touch_.function(), frames);
  put(velocity_offset_, static_cast<std::uint32_t>(output_.velocity_offset), frames);
  put(torque_offset_, static_cast<std::uint16_t>(output_.torque_offset), frames);
  put(torque_target_, static_cast<std::uint16_t>(output_.torque), frames);
  const bool brake = config_.brake.fitted && config_.brake.of_drive && brake_.output();
  put(digital_outputs_,
      (outputs_ & config_.output_mask) | (brake ? std::uint64_t{1} << config_.brake.output : 0), frames);
  ++periods_;
  TRN_CHECK(count <= 4);
  std::size_t due = 0;
  // In place: `due` never overtakes i.
  for (std::size_t i = 0; i < count; ++i)
    if (is_due(config_.rpdos[i])) frames[due++] = frames[i];
  const bool guards = config_.watch.guard_periods > 0 && ++since_guard_ >= config_.watch.guard_periods;
  if (guards) {
    since_guard_ = 0;
    frames[due++] = guard_request(config_.id);
  }
  if (CanFrame request; sdo_.step(request)) frames[due++] = request;
  TRN_CHECK(due <= frames.size());
  return static_cast<int>(due);
}

// What the drive itself said, by its emergency message or, without one, by its error code.
std::string NodeLink::details() const {
  const Shared& now = *shared_;
  std::string text;
  const std::uint16_t code = now.emergency, error = now.error_code;
  if (code != 0)
    text = fmt::format("; emergency 0x{:04X} ({}), error register 0x{:02X}", code, emergency_text(code),
                       now.error_register.load());
  else if (error != 0)
    text = fmt::format("; error code 0x603F = 0x{:04X} ({})", error, emergency_text(error));
  if (torque_.pdo >= 0) text += fmt::format("; torque {:.1f} % of the rated", 0.1 * now.torque.load());
  return text;
}

std::string NodeLink::explain() const {
  const Shared& now = *shared_;
  const std::string state = describe_statusword(now.statusword);
  const std::string emergency = details();
  switch (now.fault.load()) {
    case Fault::kOk:
      return "";
    case Fault::kDriveLost:
      return fmt::format("{}: no feedback (TPDO 0x{:03X}) for more than {} periods{}{}", config_.name,
                         config_.tpdos.empty() ? 0 : config_.tpdos[0].id, config_.watch.missed_max,
                         now.wrong_length > 0 ? "; TPDOs of another length than mapped came" : "", emergency);
    case Fault::kHeartbeatLost:
      return fmt::format("{}: no {} (0x{:03X}) for more than {} periods, feedback still comes", config_.name,
                         config_.watch.guard_periods > 0 ? "answer to node guarding" : "heartbeat",
                         cob::kGuard + static_cast<unsigned>(config_.id), config_.watch.heartbeat_periods);
    case Fault::kDriveIgnores:
      return fmt::format("{}: {}; statusword 0x6041 was 0x{:04X} ({}){}", config_.name,
                         fault_info(now.fault).meaning, now.ignoring_statusword.load(),
                         describe_statusword(now.ignoring_statusword), emergency);
    case Fault::kDriveRestarted:
      return fmt::format("{}: it sent a boot-up message; it was reset or lost power", config_.name);
    default:
      return fmt::format("{}: {}; statusword 0x6041 = 0x{:04X} ({}), NMT state {}{}", config_.name,
                         fault_info(now.fault).meaning, now.statusword.load(), state,
                         to_string(static_cast<NmtState>(now.nmt.load())), emergency);
  }
}

}  // namespace trn

#include "hal/can/node_setup.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace trn {

namespace {

constexpr std::int64_t kGuardPause = 10'000'000;  // ns between two questions for the state

bool is_bound(const SetupStep& step) {
  return step.kind == SetupStep::Kind::kAtMost || step.kind == SetupStep::Kind::kAtLeast;
}

bool only_reads(const SetupStep& step) {
  return step.kind == SetupStep::Kind::kCheck || step.kind == SetupStep::Kind::kCheckIfThere ||
         is_bound(step);
}

std::string hex(const std::vector<std::uint8_t>& bytes) {
  if (bytes.empty() || bytes.size() > 8) return fmt::format("{} bytes", bytes.size());
  return fmt::format("0x{:X}", get_le(bytes.data(), static_cast<int>(bytes.size())));
}

}  // namespace

NodeSetup::NodeSetup(const Config& config, std::int64_t now_ns)
    : config_(config), sdo_({config.id, config.sdo_timeout_ns, 1 << 16, 64, false}) {
  // Pre-operational first: PDOs are still off there and may be mapped anew, and SDO works.
  nmt_.push_back(nmt_frame(NmtCommand::kPreOperational, config_.id));
  deadline_ns_ = now_ns + config_.boot_timeout_ns;
  sdo_.read(config_.signature.key, now_ns);
}

bool NodeSetup::next_frame(CanFrame& frame) {
  // Commands of the network management go before service data: the start must not overtake the last write,
  // and it does not, since it is made only when that was answered.
  if (nmt_.empty()) return sdo_.next_frame(frame);
  frame = nmt_.front();
  nmt_.erase(nmt_.begin());
  return true;
}

void NodeSetup::receive(const CanFrame& frame, std::int64_t now_ns) {
  if (finished() || frame.error || frame.remote || frame.extended) return;
  const bool state = frame.id == cob::kGuard + static_cast<unsigned>(config_.id) && frame.size >= 1;
  // Only now is it certain that the node took everything: one that refuses Operational stays silent or stays
  // where it was.
  if (state && phase_ == Phase::kStart && nmt_state(frame.data[0]) == NmtState::kOperational)
    phase_ = Phase::kDone;
  if (state && phase_ == Phase::kSteps && nmt_state(frame.data[0]) == NmtState::kBootUp)
    return fail("it booted while it was being set up; check its supply");
  sdo_.receive(frame, now_ns);
  poll(now_ns);
}

void NodeSetup::poll(std::int64_t now_ns) {
  if (finished()) return;
  if (phase_ == Phase::kStart) {
    if (config_.guards && now_ns >= next_guard_ns_) {
      nmt_.push_back(guard_request(config_.id));
      next_guard_ns_ = now_ns + kGuardPause;
    }
    if (now_ns >= deadline_ns_)
      fail(fmt::format("{} of state 'operational' within {:g} s after it was told to start; check {}",
                       config_.guards ? "no answer to node guarding" : "no heartbeat",
                       1e-9 * static_cast<double>(config_.boot_timeout_ns),
                       config_.guards ? "0x100C and drives.guarding_ms" : "0x1017"));
    return;
  }
  sdo_.poll(now_ns);
  const bool over = sdo_.state() == SdoClient::State::kDone || sdo_.state() == SdoClient::State::kAborted;
  if (!over) return;
  phase_ == Phase::kSignature ? finish_signature(now_ns) : finish_step(now_ns);
}

void NodeSetup::finish_signature(std::int64_t now_ns) {
  const bool silent = sdo_.state() == SdoClient::State::kAborted && !sdo_.aborted_by_node() &&
                      sdo_.abort_code() == sdo_abort::kTimeout;
  if (silent && now_ns < deadline_ns_) return sdo_.read(config_.signature.key, now_ns);  // it may still boot
  if (silent)
    return fail(
        fmt::format("no answer (0x{:03X}) to SDO requests for {:g} s; check its supply, the cable and its "
                    "termination, the node id and the bit rate",
                    cob::kSdoAnswer + static_cast<unsigned>(config_.id),
                    1e-9 * static_cast<double>(config_.boot_timeout_ns)));
  // At power-on the object holds something else. If it still is what this master wrote, the node has not been
  // restarted and knows its place. A node that cannot answer for the object counts as restarted, which costs
  // a homing and no more.
  restarted_ = sdo_.state() == SdoClient::State::kAborted || sdo_.data() != config_.signature.bytes;
  phase_ = Phase::kSteps;
  step_ = 0;
  tries_ = 0;
  begin_step(now_ns);
}

void NodeSetup::begin_step(std::int64_t now_ns) {
  if (step_ == config_.steps.size()) return start(now_ns);
  const SetupStep& step = config_.steps[step_];
  using Kind = SetupStep::Kind;
  const bool reads = only_reads(step) || (step.kind == Kind::kSetBits && !set_bits_read_);
  if (reads) return sdo_.read(step.key, now_ns);
  std::vector<std::uint8_t> bytes = step.bytes;
  if (step.kind == Kind::kSetBits) {
    bytes = found_;
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] |= step.bytes[i];
  }
  sdo_.write(step.key, bytes, now_ns);
}

std::string NodeSetup::abort_text() const {
  const std::uint32_t code = sdo_.abort_code();
  return fmt::format("{} 0x{:08X} ({})", sdo_.aborted_by_node() ? "SDO abort" : "given up with", code,
                     sdo_abort_text(code));
}

std::string NodeSetup::refusal(const SetupStep& step) const {
  const bool asks = only_reads(step) || (step.kind == SetupStep::Kind::kSetBits && !set_bits_read_);
  return fmt::format("{} {} '{}'{}: {}; {}", asks ? "reading" : "writing", to_string(step.key), step.what,
                     asks ? "" : " = " + hex(step.bytes), abort_text(), step.remedy);
}

// A refusal; silence never passes.
bool NodeSetup::may_pass(const SetupStep& step) const {
  using Kind = SetupStep::Kind;
  if (!sdo_.aborted_by_node()) return false;
  const bool absent = sdo_.abort_code() == sdo_abort::kNoObject || sdo_.abort_code() == sdo_abort::kNoSub;
  const bool needed = step.kind == Kind::kWrite || step.kind == Kind::kCheck;
  return step.kind == Kind::kWish || is_bound(step) || (absent && !needed);
}

void NodeSetup::finish_step(std::int64_t now_ns) {
  const SetupStep& step = config_.steps[step_];
  if (sdo_.state() == SdoClient::State::kDone) return judge_value(now_ns);
  // Silence may be a lost frame and is tried again. A refusal would be the same the next time.
  if (!sdo_.aborted_by_node() && tries_++ < config_.retries) return begin_step(now_ns);
  if (!may_pass(step)) return fail(refusal(step));
  const bool absent = sdo_.abort_code() == sdo_abort::kNoObject || sdo_.abort_code() == sdo_abort::kNoSub;
  if (!absent) warnings_.push_back(fmt::format("{}: {}; it goes on without", config_.name, refusal(step)));
  go_on(now_ns);
}

void NodeSetup::go_on(std::int64_t now_ns) {
  ++step_;
  tries_ = 0;
  set_bits_read_ = false;
  begin_step(now_ns);
}

void NodeSetup::judge_value(std::int64_t now_ns) {
  const SetupStep& step = config_.steps[step_];
  using Kind = SetupStep::Kind;
  if (step.kind == Kind::kSetBits && !set_bits_read_) {
    found_ = sdo_.data();
    if (found_.size() != step.bytes.size())
      return fail(fmt::format("{} '{}' has {} bytes, {} are expected; check the EDS against its firmware",
                              to_string(step.key), step.what, found_.size(), step.bytes.size()));
    set_bits_read_ = true;
    return begin_step(now_ns);
  }
  if (is_bound(step)) judge_bound(step);
  const bool checks = step.kind == Kind::kCheck || step.kind == Kind::kCheckIfThere;
  if (checks && sdo_.data().size() != step.bytes.size())
    return fail(fmt::format("{} '{}' has {} bytes, {} are expected; {}", to_string(step.key), step.what,
                            sdo_.data().size(), step.bytes.size(), step.remedy));
  if (checks && sdo_.data() != step.bytes)
    return fail(fmt::format("{} '{}' is {}; {} is expected; {}", to_string(step.key), step.what,
                            hex(sdo_.data()), hex(step.bytes), step.remedy));
  go_on(now_ns);
}

void NodeSetup::judge_bound(const SetupStep& step) {
  const auto& data = sdo_.data();
  const int size = static_cast<int>(data.size());
  if (size == 0 || size > 8) {
    warnings_.push_back(
        fmt::format("{}: {} '{}' has {} bytes, so that it cannot be compared; check the EDS against "
                    "its firmware",
                    config_.name, to_string(step.key), step.what, size));
    return;
  }
  const std::int64_t value = step.is_signed ? get_le_signed(data.data(), size)
                                            : static_cast<std::int64_t>(get_le(data.data(), size));
  const bool most = step.kind == SetupStep::Kind::kAtMost;
  const bool good = most ? value <= step.bound : value >= step.bound;
  if (good || (value == 0 && step.zero_passes)) return;
  warnings_.push_back(fmt::format("{}: {} '{}' is {}; {} {} is needed; {}", config_.name, to_string(step.key),
                                  step.what, value, most ? "at most" : "at least", step.bound, step.remedy));
}

void NodeSetup::start(std::int64_t now_ns) {
  nmt_.push_back(nmt_frame(NmtCommand::kStart, config_.id));
  phase_ = config_.wait_for_heartbeat || config_.guards ? Phase::kStart : Phase::kDone;
  deadline_ns_ = now_ns + config_.boot_timeout_ns;
}

void NodeSetup::fail(const std::string& what) {
  error_ = config_.name + ": " + what;
  phase_ = Phase::kFailed;
}

}  // namespace trn

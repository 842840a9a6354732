#include "hal/can/node_setup.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace trn {

namespace {

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
    if (now_ns >= deadline_ns_)
      fail(fmt::format(
          "no heartbeat of state 'operational' within {:g} s after it was told to start; check 0x1017",
          1e-9 * static_cast<double>(config_.boot_timeout_ns)));
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
  // The consumer heartbeat is 0 at power-on. If it still is what this master wrote, the node has not been
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
  step.kind == SetupStep::Kind::kCheck ? sdo_.read(step.key, now_ns)
                                       : sdo_.write(step.key, step.bytes, now_ns);
}

std::string NodeSetup::abort_text() const {
  const std::uint32_t code = sdo_.abort_code();
  return fmt::format("{} 0x{:08X} ({})", sdo_.aborted_by_node() ? "SDO abort" : "given up with", code,
                     sdo_abort_text(code));
}

void NodeSetup::finish_step(std::int64_t now_ns) {
  const SetupStep& step = config_.steps[step_];
  if (sdo_.state() == SdoClient::State::kDone) return judge_value(now_ns);
  // Silence may be a lost frame and is tried again. A refusal would be the same the next time.
  if (!sdo_.aborted_by_node() && tries_++ < config_.retries) return begin_step(now_ns);
  const bool absent = sdo_.abort_code() == sdo_abort::kNoObject || sdo_.abort_code() == sdo_abort::kNoSub;
  const bool optional = step.kind == SetupStep::Kind::kWriteIfThere && sdo_.aborted_by_node() && absent;
  if (!optional) {
    const bool asks = step.kind == SetupStep::Kind::kCheck;
    return fail(fmt::format("{} {} '{}'{}: {}; {}", asks ? "reading" : "writing", to_string(step.key),
                            step.what, asks ? "" : " = " + hex(step.bytes), abort_text(), step.remedy));
  }
  ++step_;
  tries_ = 0;
  begin_step(now_ns);
}

void NodeSetup::judge_value(std::int64_t now_ns) {
  const SetupStep& step = config_.steps[step_];
  const bool right = step.kind != SetupStep::Kind::kCheck || sdo_.data() == step.bytes;
  if (!right)
    return fail(fmt::format("{} '{}' is {}; {} is expected; {}", to_string(step.key), step.what,
                            hex(sdo_.data()), hex(step.bytes), step.remedy));
  ++step_;
  tries_ = 0;
  begin_step(now_ns);
}

void NodeSetup::start(std::int64_t now_ns) {
  nmt_.push_back(nmt_frame(NmtCommand::kStart, config_.id));
  phase_ = config_.wait_for_heartbeat ? Phase::kStart : Phase::kDone;
  deadline_ns_ = now_ns + config_.boot_timeout_ns;
}

void NodeSetup::fail(const std::string& what) {
  error_ = config_.name + ": " + what;
  phase_ = Phase::kFailed;
}

}  // namespace trn

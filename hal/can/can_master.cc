#include "hal/can/can_master.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "core/check.h"
#include "hal/can/can_node_config.h"
#include "hal/can/nmt.h"
#include "hal/can/pdo.h"

namespace trn {

CanMaster::CanMaster(const Config& config) : config_(config), statistics_(std::make_unique<Statistics>()) {
  for (const CanNodeConfig& node : config.bus.nodes) nodes_.emplace_back(node.link);
  // The first heartbeat leaves with the first frames: drives that watch the master start their clock with it.
  since_heartbeat_ = config.heartbeat_periods;
}

std::vector<CanFilter> CanMaster::tick_filters() const {
  std::vector<CanFilter> filters = {{cob::kSync, 0x7FF},
                                    {cob::kGuard + static_cast<unsigned>(config_.master_id), 0x7FF}};
  for (const NodeLink& node : nodes_) {
    const auto id = static_cast<unsigned>(node.config().id);
    filters.push_back({cob::kEmergency + id, 0x7FF});
    filters.push_back({cob::kGuard + id, 0x7FF});
    filters.push_back({cob::kSdoAnswer + id, 0x7FF});
    for (const Pdo& pdo : node.config().tpdos) filters.push_back({pdo.id, 0x7FF});
    for (const Pdo& pdo : node.config().rpdos)
      filters.push_back({pdo.id, 0x7FF});  // nobody else may send these
  }
  return filters;
}

std::vector<CanFilter> CanMaster::service_filters() const {
  std::vector<CanFilter> filters;
  for (const NodeLink& node : nodes_) {
    const auto id = static_cast<unsigned>(node.config().id);
    filters.push_back({cob::kSdoAnswer + id, 0x7FF});
    filters.push_back({cob::kGuard + id, 0x7FF});
  }
  return filters;
}

void CanMaster::attach(CanEndpoint* endpoint) TRN_RT {
  own_periods_ = kOwnPeriods;
  endpoint_ = endpoint;
}

void CanMaster::receive() TRN_RT {
  for (NodeLink& node : nodes_) node.begin_period();
  if (!endpoint_) return;
  for (int batch = 0; batch < kBatchesPerTick; ++batch) {
    const int count = endpoint_->receive(in_);
    TRN_CHECK(count >= 0 && count <= static_cast<int>(kBatch));
    for (int i = 0; i < count; ++i) take(in_[static_cast<std::size_t>(i)]);
    // Fewer than there was room for: nothing is left. The batches are bounded, so that a node that babbles
    // cannot hold up the tick.
    if (count < static_cast<int>(kBatch)) break;
  }
  const std::int64_t confirmed_ns = endpoint_->confirmed_ns();
  // The time stamp of the last own frame on the bus. Older ones belong to the period before.
  if (confirmed_ns > last_sync_ns_ && last_sync_ns_ > 0) {
    statistics_->bus_latency.add(confirmed_ns - last_sync_ns_);
    own_periods_ = std::max(own_periods_ - 1, 0);
  }
  watch_bus();
}

void CanMaster::take(const CanFrame& frame) TRN_RT {
  statistics_->received.fetch_add(1, std::memory_order_relaxed);
  // Services are not budgeted, and most of them are the bring-up's.
  const bool service = frame.id >= cob::kSdoAnswer && frame.id <= cob::kSdoAnswer + kNodeIdMax;
  if (!service) count_time(frame);
  if (frame.error) {
    statistics_->error_reports.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  // A second master, or a tool that sends setpoints. A drive would obey whoever spoke last, so this is a
  // fault even though all drives still answer.
  if (is_foreign(frame)) {
    if (fault_ == Fault::kOk && own_periods_ == 0) fault_ = Fault::kForeignMaster;
    return;
  }
  // Each looks at the identifier itself: a bus has a handful of nodes.
  for (NodeLink& node : nodes_) node.receive(frame);
}

void CanMaster::count_time(const CanFrame& frame) TRN_RT {
  const double time_s = worst_frame_s(frame, config_.bus.bitrate, config_.bus.data_bitrate);
  statistics_->wire_ns.fetch_add(static_cast<std::uint64_t>(time_s * 1e9 + 0.5), std::memory_order_relaxed);
}

// An endpoint does not hear itself: what the master alone may send comes from somebody else.
bool CanMaster::is_foreign(const CanFrame& frame) const TRN_RT {
  if (frame.extended || frame.remote) return false;
  if (frame.id == cob::kSync || frame.id == cob::kGuard + static_cast<unsigned>(config_.master_id))
    return true;
  for (const NodeLink& node : nodes_)
    for (const Pdo& pdo : node.config().rpdos)
      if (frame.id == pdo.id) return true;
  return false;
}

void CanMaster::watch_bus() TRN_RT {
  switch (endpoint_->state()) {
    case BusState::kOnline:
      return;
    case BusState::kBusOff:
      return lose_nodes(Fault::kBusOff);
    case BusState::kDown:
      return lose_nodes(Fault::kBusDown);
  }
}

void CanMaster::lose_nodes(Fault fault) TRN_RT {
  TRN_CHECK(fault != Fault::kOk);
  if (fault_ == Fault::kOk) fault_ = fault;
  for (NodeLink& node : nodes_) node.lose(fault);
}

void CanMaster::reset() TRN_RT {
  fault_ = Fault::kOk;
  overloaded_ = 0;
  for (NodeLink& node : nodes_) node.reset();
}

std::size_t CanMaster::collect() TRN_RT {
  std::size_t count = 0;
  if (config_.sync_counter > 0) counter_ = counter_ % config_.sync_counter + 1;
  // SYNC first: everything else of the period is sent behind it, and jitter of the setpoints' frames does not
  // matter, since they act with the next SYNC.
  out_[count++] = sync_frame(counter_);
  NodeLink::Frames frames;
  for (NodeLink& node : nodes_) {
    const int more = node.fill(frames);
    TRN_CHECK(more >= 0 && more <= static_cast<int>(frames.size()));
    TRN_CHECK(count + static_cast<std::size_t>(more) <= out_.size());
    for (int i = 0; i < more && count < out_.size(); ++i) out_[count++] = frames[static_cast<std::size_t>(i)];
  }
  // Last, since it may wait: a heartbeat that did not fit leaves with the next period, because its count is
  // not reset.
  const bool beats = config_.heartbeat_periods > 0 && ++since_heartbeat_ >= config_.heartbeat_periods;
  if (beats && count < out_.size()) {
    since_heartbeat_ = 0;
    out_[count++] = heartbeat_frame(config_.master_id, NmtState::kOperational);
  }
  return count;
}

void CanMaster::send() TRN_RT {
  if (!endpoint_) return;
  const std::int64_t now_ns = endpoint_->now_ns();
  const std::size_t count = collect();
  TRN_CHECK(count >= 1 && count <= out_.size());
  const int taken = endpoint_->send({out_.data(), count});
  TRN_CHECK(taken <= static_cast<int>(count));
  if (last_sync_ns_ > 0)
    statistics_->sync_jitter.add(
        std::llabs(now_ns - last_sync_ns_ - static_cast<std::int64_t>(config_.period_s * 1e9 + 0.5)));
  last_sync_ns_ = now_ns;
  statistics_->periods.fetch_add(1, std::memory_order_relaxed);
  statistics_->sent.fetch_add(static_cast<std::uint64_t>(std::max(taken, 0)), std::memory_order_relaxed);
  for (int i = 0; i < taken; ++i) count_time(out_[static_cast<std::size_t>(i)]);
  const bool all = taken == static_cast<int>(count);
  // One period without room is a burst of services. Several in a row mean drives without setpoints.
  overloaded_ = all ? 0 : overloaded_ + 1;
  if (!all) statistics_->unsent.fetch_add(count - static_cast<std::size_t>(std::max(taken, 0)));
  if (overloaded_ > config_.overload_max && fault_ == Fault::kOk) fault_ = Fault::kBusOverload;
}

double CanMaster::measured_load() const {
  const double span_s = static_cast<double>(statistics_->periods.load()) * config_.period_s;
  return span_s > 0 ? 1e-9 * static_cast<double>(statistics_->wire_ns.load()) / span_s : 0;
}

std::string CanMaster::health() const {
  const Statistics& now = *statistics_;
  const auto ranks = [](const TimeHistogram& times) {
    return fmt::format("p50 {:.0f} p99 {:.0f} p99.9 {:.0f} max {:.0f} us", times.percentile_us(0.5),
                       times.percentile_us(0.99), times.percentile_us(0.999), times.max_us());
  };
  return fmt::format(
      "{}: load {:.1f} % of {:.1f} % budgeted, SYNC jitter {}, setpoints on the bus after {}, sent {}, "
      "unsent {}, received {}, error reports {}",
      config_.bus.interface, 100 * measured_load(), 100 * config_.bus.budget.load(), ranks(now.sync_jitter),
      ranks(now.bus_latency), now.sent.load(), now.unsent.load(), now.received.load(),
      now.error_reports.load());
}

}  // namespace trn

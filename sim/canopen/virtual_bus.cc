#include "sim/canopen/virtual_bus.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "hal/can/bus_budget.h"

namespace trn {

namespace {
constexpr std::int64_t kPollNs = 200'000;
constexpr std::size_t kQueueMax = 512;  // frames of an endpoint, either way
}  // namespace

class VirtualBus::Endpoint final : public CanEndpoint {
 public:
  Endpoint(VirtualBus& bus, const std::vector<CanFilter>& filters) : bus_(&bus), filters_(filters) {}
  ~Endpoint() override {
    if (bus_) std::erase(bus_->endpoints_, this);
  }
  Endpoint(const Endpoint&) = delete;
  Endpoint& operator=(const Endpoint&) = delete;

  int send(std::span<const CanFrame> frames) TRN_RT override {
    if (state() != BusState::kOnline || bus_->jammed_) return 0;
    int count = 0;
    for (const CanFrame& frame : frames) {
      if (!out.push(frame)) break;
      ++count;
    }
    return count;
  }
  int receive(std::span<CanFrame> frames) TRN_RT override {
    const std::size_t count = std::min(frames.size(), in_.size());
    for (std::size_t i = 0; i < count; ++i, in_.pop()) frames[i] = in_.front();
    return static_cast<int>(count);
  }
  BusState state() const TRN_RT override { return bus_ ? bus_->state_ : BusState::kDown; }
  std::int64_t now_ns() const TRN_RT override { return bus_ ? bus_->now_ns_ : 0; }
  void wait(std::int64_t timeout_ns) override {
    // Who waits lets the virtual time pass; nothing here waits for the host's clock.
    if (bus_) bus_->run_until(bus_->now_ns_ + timeout_ns);
  }
  std::string recover() override {
    if (bus_ && bus_->repairable_) bus_->state_ = BusState::kOnline;
    return state() == BusState::kOnline ? "" : "the virtual bus is off";
  }

  std::int64_t confirmed_ns() const TRN_RT override { return confirmed_ns_; }
  void confirm() { confirmed_ns_ = bus_->now_ns_; }
  void hear(const CanFrame& frame) {
    const bool wanted = std::any_of(filters_.begin(), filters_.end(), [&](const CanFilter& filter) {
      return (frame.id & filter.mask) == (filter.id & filter.mask) && !frame.extended;
    });
    if (wanted) in_.push(frame);
  }
  void clear() {
    out.clear();
    in_.clear();
  }
  void detach() { bus_ = nullptr; }

  FrameQueue out{kQueueMax};

 private:
  VirtualBus* bus_;
  std::int64_t confirmed_ns_ = 0;
  std::vector<CanFilter> filters_;
  FrameQueue in_{kQueueMax};
};

VirtualBus::~VirtualBus() {
  for (Endpoint* endpoint : endpoints_) endpoint->detach();
}

std::unique_ptr<CanEndpoint> VirtualBus::open(const std::vector<CanFilter>& filters) {
  auto endpoint = std::make_unique<Endpoint>(*this, filters);
  endpoints_.push_back(endpoint.get());
  return endpoint;
}

void VirtualBus::add(EmulatedNode& node) {
  nodes_.push_back(&node);
  node_queues_.emplace_back(1);  // what the controller has in hand
}

void VirtualBus::set_state(BusState state, bool repairable) {
  state_ = state;
  repairable_ = repairable;
  if (state != BusState::kOnline)
    for (Endpoint* endpoint : endpoints_) endpoint->clear();
}

// Arbitration: every controller offers the first frame of its queue; the lowest identifier wins.
bool VirtualBus::pick(CanFrame& frame, Endpoint*& sender) {
  FrameQueue* best = nullptr;
  sender = nullptr;
  const auto offer = [&](FrameQueue& queue, Endpoint* owner) {
    if (queue.empty() || (best && best->front().id <= queue.front().id)) return;
    best = &queue;
    sender = owner;
  };
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    CanFrame next;
    if (node_queues_[i].empty() && nodes_[i]->next_frame(now_ns_, next)) node_queues_[i].push(next);
    offer(node_queues_[i], nullptr);
  }
  for (Endpoint* endpoint : endpoints_) offer(endpoint->out, endpoint);
  offer(foreign_, nullptr);
  if (!best) return false;
  frame = best->front();
  best->pop();
  return true;
}

void VirtualBus::deliver(const CanFrame& frame, Endpoint* sender) {
  CanFrame heard = frame;
  heard.time_ns = now_ns_;
  ++frames_;
  if (listener_) listener_(heard);
  for (EmulatedNode* node : nodes_) node->receive(heard, now_ns_);
  // Only the host's controller is off the bus. The nodes go on hearing each other.
  if (state_ != BusState::kOnline) return;
  for (Endpoint* endpoint : endpoints_) endpoint == sender ? endpoint->confirm() : endpoint->hear(heard);
}

// FD frames at their longest.
std::int64_t VirtualBus::duration_ns(const CanFrame& frame) const {
  const double time_s =
      frame.fd ? worst_frame_s(frame, bitrate_, data_bitrate_) : frame_bits(frame) / bitrate_;
  return std::llround(time_s * 1e9);
}

void VirtualBus::poll_nodes() {
  for (EmulatedNode* node : nodes_) node->poll(now_ns_);
  next_poll_ns_ = now_ns_ + kPollNs;
}

void VirtualBus::run_until(std::int64_t time_ns) {
  while (now_ns_ < time_ns) {
    if (now_ns_ >= next_poll_ns_) poll_nodes();
    if (!in_flight_ && pick(current_, current_sender_)) {
      in_flight_ = true;
      // A frame that has begun is not interrupted: who is ready meanwhile waits for its end, and then the
      // lowest identifier goes first.
      const std::int64_t takes_ns = duration_ns(current_);
      end_ns_ = now_ns_ + takes_ns;
      busy_ns_ += takes_ns;
    }
    // idle: nodes may get ready with their answers
    const std::int64_t next_ns = in_flight_ ? end_ns_ : std::min(next_poll_ns_, now_ns_ + 10'000);
    TRN_CHECK(next_ns > now_ns_);
    now_ns_ = std::min(next_ns, time_ns);
    if (!in_flight_ || now_ns_ < end_ns_) continue;
    in_flight_ = false;
    deliver(current_, current_sender_);
  }
}

}  // namespace trn

#include "app/daemon/scope_server.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/client/command_rights.h"
#include "core/config.h"

namespace trn {

namespace {

using trunnion::scope_data_t;
using trunnion::scope_request_t;

// A packet of the socket is as long as a datagram; what is beside the rows takes less than a tenth of it.
constexpr std::size_t kDataBytes = 56'000;

// Very short periods do not take all of the memory.
std::size_t rows_of(double seconds, double period_s) {
  constexpr double kRowsMax = 100'000;
  return static_cast<std::size_t>(std::clamp(std::ceil(seconds / period_s), 10.0, kRowsMax));
}

}  // namespace

ScopeServer::ScopeServer(LocalServer& socket, const AccessRules& access, const LcmConfig& names,
                         const Machine& machine, const SignalTable& table, const ScopeConfig& config,
                         const std::string& keep_beside)
    : socket_(socket),
      access_(access),
      names_(names),
      table_(table),
      sampler_(table),
      ring_(table.columns(), rows_of(config.seconds, machine.period_s)),
      keeper_(config, machine, table, keep_beside) {
  socket_.subscribe<scope_request_t>(names.scope_request_channel(),
                                     [this](const scope_request_t& request) { receive(request); });
}

void ScopeServer::report(const CycleReport& report) {
  sampler_.sample(report, ring_.push(report.period));
  keeper_.report(report, ring_);
}

void ScopeServer::receive(const scope_request_t& request) {
  const Peer* peer = socket_.peer(socket_.sender());
  if (!peer || !access_.allows(*peer, Role::kLook)) return;
  if (!gate_.admit({peer->uid, peer->pid}, CommandGate::Clock::now())) return;  // it asks again
  request.signal_count == 0 ? answer_list(request) : answer(request);
}

void ScopeServer::answer_list(const scope_request_t& request) {
  trunnion::scope_signals_t list{};
  list.client = request.client;
  list.sequence = request.sequence;
  list.period_s = table_.period_s();
  for (const Signal& signal : table_.signals()) {
    list.name.push_back(signal.name);
    list.unit.push_back(signal.unit);
    list.meaning.push_back(signal.meaning);
  }
  list.count = static_cast<std::int32_t>(list.name.size());
  socket_.send(socket_.sender(), names_.scope_signals_channel(), list);
}

// Returns what is wrong with the names.
std::string ScopeServer::find(const scope_request_t& request, std::vector<const Signal*>& signals) const {
  if (static_cast<std::size_t>(request.signal_count) > kSignalsMax)
    return fmt::format("{} signals; {} at a time are legal", request.signal_count, kSignalsMax);
  for (const std::string& name : request.signal) {
    signals.push_back(table_.find(name));
    if (signals.back()) continue;
    std::vector<std::string> names;
    for (const Signal& signal : table_.signals()) names.push_back(signal.name);
    const std::string near = nearest_word(name, names);
    return fmt::format("there is no signal '{}'{}", name,
                       near.empty() ? "" : fmt::format("; did you mean '{}'?", near));
  }
  return "";
}

void ScopeServer::answer(const scope_request_t& request) {
  scope_data_t data{};
  data.client = request.client;
  data.sequence = request.sequence;
  data.period_s = table_.period_s();
  data.oldest_period = ring_.size() > 0 ? static_cast<std::int64_t>(ring_.period(0)) : -1;
  data.newest_period = ring_.size() > 0 ? static_cast<std::int64_t>(ring_.period(ring_.size() - 1)) : -1;
  std::vector<const Signal*> signals;
  data.message = find(request, signals);
  if (data.message.empty()) fill(request, signals, data);
  data.row_count = static_cast<std::int32_t>(data.period.size());
  data.value_count = static_cast<std::int32_t>(data.value.size());
  socket_.send(socket_.sender(), names_.scope_data_channel(), data);
}

void ScopeServer::fill(const scope_request_t& request, const std::vector<const Signal*>& signals,
                       scope_data_t& data) const {
  const std::int64_t from = request.from_period;
  const auto last = static_cast<std::int64_t>(ring_.size());
  const std::size_t first = from < 0 ? static_cast<std::size_t>(std::max<std::int64_t>(0, last + from))
                                     : ring_.first_from(static_cast<std::uint64_t>(from));
  const std::size_t room = kDataBytes / (8 * (signals.size() + 1));
  const std::size_t most = std::min(room, static_cast<std::size_t>(std::max(0, request.rows_max)));
  for (std::size_t row = first; row < ring_.size() && row < first + most; ++row) {
    data.period.push_back(static_cast<std::int64_t>(ring_.period(row)));
    for (const Signal* signal : signals) data.value.push_back(signal->value(ring_.row(row)));
  }
}

}  // namespace trn

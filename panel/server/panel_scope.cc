#include <cmath>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "panel/server/controls.h"
#include "panel/server/page_message.h"
#include "panel/server/panel_state.h"

// The daemon's scope, as pages ask for it: who may look may ask, and the daemon answers each question once.
namespace trn {

namespace {

constexpr std::size_t kScopesMax = 256, kWaitingMax = 32;
constexpr double kDigits = 1e6;  // of mm, degrees and newtons more say nothing

// Not a number, where the daemon does not know a value, becomes null.
nlohmann::json rounded(double value) {
  return std::abs(value) < 1e9 ? nlohmann::json(std::round(value * kDigits) / kDigits)
                               : nlohmann::json(value);
}

}  // namespace

void PanelState::ask_scope(PageId id, const PageMessage& message) {
  if (pages_.at(id).events.size() > kWaitingMax) return;  // it does not read; it will ask again
  const std::int32_t sequence = daemon_.send(message.scope);
  if (sequence == 0) return;
  scopes_[sequence] = {id, message.id};
  if (scopes_.size() > kScopesMax) scopes_.erase(scopes_.begin());  // never answered
}

PanelState::Page* PanelState::scope_page(std::int32_t sequence, nlohmann::json& id) {
  const auto asked = scopes_.find(sequence);
  if (asked == scopes_.end()) return nullptr;
  const auto page = pages_.find(asked->second.first);
  id = asked->second.second;
  scopes_.erase(asked);
  return page == pages_.end() ? nullptr : &page->second;
}

void PanelState::hear_scope_signals(const trunnion::scope_signals_t& list) {
  nlohmann::json id;
  Page* page = scope_page(list.sequence, id);
  if (!page) return;
  nlohmann::json signals = nlohmann::json::array();
  for (std::size_t i = 0; i < list.name.size(); ++i)
    signals.push_back({{"name", list.name[i]}, {"unit", list.unit[i]}, {"meaning", list.meaning[i]}});
  put(*page, {{"type", "scope_signals"}, {"id", id}, {"period_s", list.period_s}, {"signals", signals}});
}

void PanelState::hear_scope_data(const trunnion::scope_data_t& data) {
  nlohmann::json id;
  Page* page = scope_page(data.sequence, id);
  if (!page) return;
  const std::size_t rows = data.period.size(), signals = rows == 0 ? 0 : data.value.size() / rows;
  nlohmann::json values = nlohmann::json::array();
  for (std::size_t k = 0; k < signals; ++k) {
    nlohmann::json column = nlohmann::json::array();
    for (std::size_t row = 0; row < rows; ++row) column.push_back(rounded(data.value[row * signals + k]));
    values.push_back(std::move(column));
  }
  put(*page, {{"type", "scope_data"},
              {"id", id},
              {"text", data.message},
              {"period_s", data.period_s},
              {"oldest", data.oldest_period},
              {"newest", data.newest_period},
              {"periods", data.period},
              {"values", values}});
}

}  // namespace trn

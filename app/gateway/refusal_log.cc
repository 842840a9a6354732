#include "app/gateway/refusal_log.h"

#include <fmt/format.h>

#include <string_view>

namespace trn {

namespace {

constexpr auto kTellAgain = std::chrono::minutes(1);
constexpr std::array<std::string_view, static_cast<std::size_t>(Refusal::kCount)> kTexts{
    "of unknown keys",
    "with a counter that is not new (replayed, or of a clock that is behind)",
    "with a false signature",
    "not looked at after too many false signatures of their sender",
    "with no sound message inside",
    "that their key may not send",
    "beyond 'rate_hz_max'",
    "that would never expire"};
static_assert(!kTexts.back().empty());  // a row for each

}  // namespace

std::string RefusalLog::news(Clock::time_point now) {
  if (counts_ == told_ || now < quiet_until_) return "";
  std::string text;
  for (std::size_t i = 0; i < counts_.size(); ++i)
    if (counts_[i] != told_[i])
      text += fmt::format("{}{} {}", text.empty() ? "refused: " : ", ", counts_[i] - told_[i], kTexts[i]);
  told_ = counts_;
  quiet_until_ = now + kTellAgain;
  return text;
}

}  // namespace trn

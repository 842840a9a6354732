#include "app/daemon/correction_warnings.h"

#include <spdlog/spdlog.h>

#include <cstring>
#include <string>

namespace trn {

bool CorrectionWarnings::hear(const SetpointChain& chain, const CycleReport& report) {
  bool news = false;
  for (int i = 0; i < chain.size(); ++i) {
    const char* warning = report.corrections[static_cast<std::size_t>(i)].warning;
    const char*& last = last_[static_cast<std::size_t>(i)];
    if (std::strcmp(warning, last) == 0) continue;
    last = warning;
    news = true;
    const std::string& name = chain.budget(i).name;
    *warning ? spdlog::warn("correction '{}': {}", name, warning)
             : spdlog::info("correction '{}': all is well again", name);
  }
  return news;
}

}  // namespace trn

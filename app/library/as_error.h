#pragma once

#include <exception>
#include <utility>

#include "app/library/trunnion.h"

namespace trn {

/// Runs `work`; whatever the parts throw leaves the library as its own exception.
template <typename Work>
auto as_error(Work&& work) {
  try {
    return std::forward<Work>(work)();
  } catch (const trunnion::Error&) {
    throw;
  } catch (const std::exception& error) {
    throw trunnion::Error(error.what());
  }
}

}  // namespace trn

#pragma once

#include <cstdint>
#include <string>

namespace trn::world {

/// Lives through one seed and ends the process: its result (a finding, or the digest and the length of the
/// session) goes to `result_fd`. `folder` is empty and the session's own.
[[noreturn]] void live(std::uint64_t seed, bool verbose, int result_fd, const std::string& folder);

}  // namespace trn::world

#pragma once

namespace trn {

/// Whether this build looks for errors of memory or threads as it runs (-fsanitize). Its own memory would
/// count where a process limits what it may have.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace trn

#pragma once

#include "hal/lcm_link.h"

namespace trn {

/// The lock covers this host and folder; a daemon beyond them is heard on LCM. std::runtime_error if one is
/// heard whose word counts (see is_trusted_user); of others on this host the log tells, and they change
/// nothing. Takes 0.35 s.
void refuse_second_daemon(const LcmConfig& config);

}  // namespace trn

#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

namespace trn {

// Users and groups of this host. The C library's plain calls share one answer among all threads (getpwuid(3),
// ATTRIBUTES); these may be called from any thread, and allocate.

/// Name of a user by /etc/passwd alone: a directory service may lie on a network, and may take its time. Of
/// one who does not stand there the number.
std::string user_name(uid_t uid);

/// Of the user that this process runs as, as the system knows it, whatever HOME says; "" if there is none.
std::string home_folder();

/// Number of a group; nothing if this host has none of that name.
std::optional<gid_t> group_id(const std::string& name);

}  // namespace trn

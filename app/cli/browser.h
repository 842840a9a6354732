#pragma once

#include <string>

namespace trn {

/// Shows a file in the user's browser, where this runs in a terminal and there is a display; false where not.
bool open_in_browser(const std::string& path);

}  // namespace trn

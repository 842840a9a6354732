#pragma once

#include <string>

namespace trn {

/// In the text of a config, the `number`-th table (from 0) with the header `header`, as "[[drives.node]]",
/// gets `key = value`: in place of the value that is there, else as its last line. Comments and order stay.
/// std::runtime_error if there is no such table.
std::string with_key(const std::string& text, const std::string& header, int number, const std::string& key,
                     const std::string& value);

}  // namespace trn

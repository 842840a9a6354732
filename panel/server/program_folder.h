#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "panel/server/page_folder.h"

namespace trn {

/// A program that a page may not load; what() says why, for the page.
struct NoProgram : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The real path of a program that a page names, by its path in the folder or an absolute one. NoProgram
/// unless it is a regular file that lies, behind all links, below `folder`.
std::string program_path(const std::string& folder, const std::string& name);

/// A program or a drawing by its real path; nothing if it is no regular file any more.
std::optional<OpenFile> open_file(const std::string& path);

/// Keeps the text of a program in the folder, in the place of one that has this name; what is there after a
/// power cut is the old one or the new one. NoProgram where the name is none of a program in the folder
/// itself (letters, digits, space, . _ -, one of the endings), or the file cannot be written.
void keep_program(const std::string& folder, const std::string& name, const std::string& text);

struct ProgramFile {
  std::string name;
  std::uint64_t size = 0;       ///< bytes
  std::int64_t modified_s = 0;  ///< of Unix time
};
/// The programs that lie in the folder itself, by name: files that `program_path` gives, of an ending that
/// programs have (.ngc .nc .cnc .tap .gcode), hidden ones not. At most 1000 of the first 10,000 entries.
std::vector<ProgramFile> list_programs(const std::string& folder);

}  // namespace trn

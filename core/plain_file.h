#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

namespace trn {

/// A file that cannot be read; what() says why and what would be right, without the file's name.
struct PlainFileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The bytes of the regular file `path`. PlainFileError for everything else that may stand there, at once and
/// without opening it: a folder, and a pipe or a device, at which reading might never end. Also for a file of
/// more than `bytes_max`.
std::string read_plain_file(const std::string& path, std::size_t bytes_max);

/// The bytes of a file that somebody names for one command, who can wait and end it: a pipe, too, is read to
/// its end. PlainFileError for a folder, for what cannot be read, and for more than 4 GB; here what() begins
/// with the file's name.
std::string read_named_file(const std::string& path);

/// Opens `path` for writing, emptied or made anew (with `mode`), and waits for nobody: a pipe that nobody
/// reads is refused at once, as is everything that cannot be written. PlainFileError; else the descriptor,
/// which is the caller's.
int open_to_write(const std::string& path, unsigned mode);

/// True for a pipe: whoever writes there waits for its reader.
bool is_pipe(const std::string& path);

}  // namespace trn

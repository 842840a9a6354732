#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace trn {

/// The last counter of each key, on disk, so that nothing that was handed on can come in a second time, not
/// even after a kill or a power cut. One process at a time has it.
class CounterFile {
 public:
  /// A file that is not there yet holds no counter. std::runtime_error if it is damaged, of another machine,
  /// cannot be written or is in use.
  CounterFile(std::string path, std::string machine);
  ~CounterFile();
  CounterFile(const CounterFile&) = delete;
  CounterFile& operator=(const CounterFile&) = delete;

  /// 0 if nothing of this key was handed on yet.
  std::int64_t last(const std::string& key) const;
  /// Changes nothing on disk.
  void raise(const std::string& key, std::int64_t counter);
  /// When this returns, the counters are on the disk (write_file_safely). FileError.
  void save() const;
  /// True if the file was not there.
  bool is_new() const { return new_; }

 private:
  void lock();
  void read();

  std::string path_, machine_;
  std::map<std::string, std::int64_t> counters_;  // also of keys that the config no longer has
  int lock_ = -1;
  bool new_ = false;
};

}  // namespace trn

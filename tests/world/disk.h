#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <vector>

namespace trn::world {

/// What goes wrong with the disk of a session.
struct DiskMalice {
  double fault_share = 0;    ///< of the calls that write, those that fail
  double torn_share = 0;     ///< of the writes, those that take a part only
  std::int64_t slow_ns = 0;  ///< a call takes up to this long
};

/// The disk below one folder, with a cache that forgets: what was written is there for all to see, but a
/// power cut leaves of a file's content what was synced, and of what came later nothing, a part or all; and
/// of the names of the folder those that were synced, and of what came later a part in its order.
class Disk {
 public:
  static void begin(const std::string& folder, const DiskMalice& malice, std::uint64_t seed);
  /// Null: there is none, or the path is not below its folder.
  static Disk* of(const char* path);
  static Disk* of(int fd);

  /// What a call that writes shall fail with; 0: it works. Takes its time.
  int trouble(const char* call);
  /// How much of a write is taken.
  std::size_t share_of(std::size_t size);

  void opened(const char* path, int fd, int flags);
  void written(int fd);
  void synced(int fd);
  void renamed(const std::string& from, const std::string& to);
  void unlinked(const std::string& path);
  void closed(int fd) { open_.erase(fd); }
  /// Errors end now.
  void mend() { malice_ = {}; }

  /// What the file holds after a power cut now: nothing where its name is not there.
  struct Content {
    bool there = false;
    std::string text;
  };
  Content after_power_cut(const std::string& path);

 private:
  struct File {
    std::string safe;    ///< content that is on the disk
    bool dirty = false;  ///< there is more in the cache
  };
  using FilePtr = std::shared_ptr<File>;
  struct Change {
    std::string gone, made;  ///< names; "": none
    FilePtr file;            ///< that has the name `made`
  };
  struct Open {
    FilePtr file;  ///< null: a folder
    std::string path;
  };
  FilePtr file_of(const std::string& path);

  std::string folder_;
  DiskMalice malice_;
  std::mt19937_64 random_;
  std::map<std::string, FilePtr> names_, safe_names_;  ///< as the system shows them, as the disk has them
  std::vector<Change> changes_;                        ///< of names, not yet synced
  std::map<int, Open> open_;
};

}  // namespace trn::world

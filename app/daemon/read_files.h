#pragma once

#include <map>
#include <mutex>
#include <string>

namespace trn {

/// Files that a program was read from, as they were then: what is cut is what was loaded and shown.
class ReadFiles {
 public:
  ReadFiles() = default;
  ReadFiles(const ReadFiles& other);
  ReadFiles& operator=(const ReadFiles& other);

  void clear();
  /// Of a file that has been opened as a program; one that is known stays as it was. From any thread.
  void note(const std::string& path);
  /// ProgramError for the first that is not the same any more.
  void check() const;
  /// Of a file that was noted: as file_mark.
  std::string mark(const std::string& path) const;

 private:
  struct File {
    std::string stamp;  ///< changes with every writing of it; the same: so is the content
    std::string mark;
  };
  std::map<std::string, File> files() const;

  mutable std::mutex mutex_;
  std::map<std::string, File> files_;
};

}  // namespace trn

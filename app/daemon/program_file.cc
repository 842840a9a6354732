#include "app/daemon/program_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <mutex>

#include "interp/gcode/error.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/text/block.h"
#include "interp/gcode/text/parser.h"

namespace trn {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kChunk = std::size_t{1} << 17;
constexpr std::size_t kHeadBytes = std::size_t{1} << 16;
constexpr int kHeadLines = 100;
constexpr auto kLookAgain = std::chrono::milliseconds(20);  // whether the work was given up

/// What the file's thread and its owner share; whoever is last lets it go.
struct FileRequest {
  std::mutex mutex;
  std::condition_variable changed;
  FileCalls calls;
  std::string path;
  std::shared_ptr<std::atomic<int>> stuck;
  bool asked = false, left = false, counted = false;  // guarded by mutex, as all below
  std::uint64_t offset = 0;
  std::size_t size = 0;
  int fd = -1;  // -1: not open yet
  int error = 0;
  std::vector<char> bytes;
};

// Without O_NONBLOCK, opening a FIFO would wait for its writer.
int open_plain(const char* path) {
  const int fd = ::open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  struct stat info {};
  if (fd < 0 || (::fstat(fd, &info) == 0 && S_ISREG(info.st_mode))) return fd;
  ::close(fd);
  errno = S_ISDIR(info.st_mode) ? EISDIR : ENOTSUP;
  return -1;
}

// The first request opens the file. Nothing of the request but what was asked for is touched outside the
// lock.
void serve(const std::shared_ptr<FileRequest>& request) {
  pthread_setname_np(pthread_self(), "program file");
  std::unique_lock lock(request->mutex);
  int fd = -1;
  while (true) {
    request->changed.wait(lock, [&] { return request->asked || request->left; });
    if (request->left) break;
    const std::uint64_t offset = request->offset;
    std::vector<char> bytes(request->size);
    lock.unlock();
    errno = 0;
    if (fd < 0) fd = request->calls.open(request->path.c_str());
    ssize_t got = fd < 0 || bytes.empty() ? 0 : request->calls.read(fd, bytes.data(), bytes.size(), offset);
    while (got < 0 && errno == EINTR) got = request->calls.read(fd, bytes.data(), bytes.size(), offset);
    const int error = fd < 0 || got < 0 ? errno : 0;
    bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(0, got)));
    lock.lock();
    request->error = error;
    request->bytes = std::move(bytes);
    request->asked = false;
    request->changed.notify_all();
  }
  if (request->counted) --*request->stuck;
  lock.unlock();
  if (fd >= 0) ::close(fd);
}

// A stack of its own size: in a daemon whose memory is locked, all of it is there for as long as the file is
// open.
void serve_in_thread(const std::shared_ptr<FileRequest>& request) {
  constexpr std::size_t kStackBytes = std::size_t{1} << 18;
  auto handed = std::make_unique<std::shared_ptr<FileRequest>>(request);
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, kStackBytes);
  pthread_attr_setdetachstate(&attributes, PTHREAD_CREATE_DETACHED);
  pthread_t thread;
  const auto run = [](void* given) -> void* {
    const std::unique_ptr<std::shared_ptr<FileRequest>> own(
        static_cast<std::shared_ptr<FileRequest>*>(given));
    serve(*own);
    return nullptr;
  };
  const int error = pthread_create(&thread, &attributes, run, handed.get());
  pthread_attr_destroy(&attributes);
  if (error != 0)
    fail(GcodeErrorCode::kCannotOpen, 0,
         fmt::format("'{}': no thread to read it: {}", request->path, std::strerror(error)));
  static_cast<void>(handed.release());  // the thread's now
}

class WatchedFile final : public ByteSource {
 public:
  WatchedFile(std::shared_ptr<FileRequest> request, const std::atomic<bool>& given_up, double patience_s)
      : request_(std::move(request)), given_up_(given_up), patience_s_(patience_s) {
    serve_in_thread(request_);
  }
  ~WatchedFile() override { leave(); }
  WatchedFile(const WatchedFile&) = delete;
  WatchedFile& operator=(const WatchedFile&) = delete;

  std::size_t read(char* to, std::size_t size) override {
    const int error = ask(std::min(size, kChunk));
    if (error != 0) refuse(std::strerror(error));
    std::copy(request_->bytes.begin(), request_->bytes.end(), to);
    offset_ += request_->bytes.size();
    return request_->bytes.size();
  }
  bool seek(std::uint64_t offset) override {
    offset_ = offset;
    return true;
  }
  /// Opens the file; errno, or 0.
  int open() { return ask(0); }
  [[noreturn]] void refuse(std::string_view why) const {
    fail(GcodeErrorCode::kCannotOpen, 0, fmt::format("'{}': {}", request_->path, why));
  }

 private:
  // Behind it the answer stands still until the next question.
  int ask(std::size_t size) {
    std::unique_lock lock(request_->mutex);
    if (request_->left) refuse("it did not answer before");
    request_->offset = offset_;
    request_->size = size;
    request_->asked = true;
    request_->changed.notify_all();
    const auto end = Clock::now() +
                     std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(patience_s_));
    while (request_->asked && !given_up_ && Clock::now() < end)
      request_->changed.wait_for(lock, kLookAgain, [this] { return !request_->asked; });
    if (!request_->asked && !given_up_) return request_->error;
    const bool silent = request_->asked;
    lock.unlock();
    leave();
    if (given_up_) refuse("reading was given up");
    refuse(silent ? fmt::format("its file system has not answered for {:g} s", patience_s_) : "no answer");
  }

  void leave() {
    const std::lock_guard lock(request_->mutex);
    if (!request_->left && request_->asked) {
      request_->counted = true;
      ++*request_->stuck;
    }
    request_->left = true;
    request_->changed.notify_all();
  }

  std::shared_ptr<FileRequest> request_;
  const std::atomic<bool>& given_up_;
  double patience_s_;
  std::uint64_t offset_ = 0;
};

bool has_code(std::string_view line) {
  const std::size_t first = line.find_first_not_of(" \t\r");
  return first != std::string_view::npos && std::strchr("(;%", line[first]) == nullptr;
}

}  // namespace

FileCalls FileCalls::of_system() {
  return {open_plain, [](int fd, char* to, std::size_t size, std::uint64_t offset) {
            return ::pread(fd, to, size, static_cast<off_t>(offset));
          }};
}

bool may_be_program(std::string_view head, const std::vector<MappedWord>& words) {
  NameTable names, labels;
  Parser parser(names, labels, words);
  ParsedBlock block;
  bool any = false;
  for (int lines = 0; lines < kHeadLines && !head.empty();) {
    const std::size_t end = std::min(head.find('\n'), head.size());
    std::string_view line = head.substr(0, end);
    head.remove_prefix(std::min(end + 1, head.size()));
    while (line.ends_with('\r')) line.remove_suffix(1);
    if (!has_code(line)) continue;
    any = true;
    ++lines;
    try {
      parser.parse(line, block);
      return true;
    } catch (const BlockError&) {  // perhaps the next one is
    }
  }
  return !any;
}

ProgramFiles::ProgramFiles(const std::atomic<bool>& given_up, const std::vector<MappedWord>& words,
                           double patience_s, FileCalls calls)
    : given_up_(given_up),
      words_(words),
      patience_s_(patience_s),
      calls_(std::move(calls)),
      stuck_(std::make_shared<std::atomic<int>>(0)) {}

std::unique_ptr<ByteSource> ProgramFiles::open(const std::string& path, bool may_be_missing) const {
  if (*stuck_ >= kStuckMax)
    fail(GcodeErrorCode::kCannotOpen, 0,
         fmt::format("'{}': too many files have not answered; mend their share", path));
  auto request = std::make_shared<FileRequest>();
  request->calls = calls_;
  request->path = path;
  request->stuck = stuck_;
  auto file = std::make_unique<WatchedFile>(request, given_up_, patience_s_);
  const int error = file->open();
  const bool missing = error == ENOENT || error == ENOTDIR || error == EISDIR;
  if (missing && may_be_missing) return nullptr;
  if (error == EISDIR) file->refuse("it is a folder");
  if (error == ENOTSUP) file->refuse("it is no regular file");
  if (error != 0) file->refuse(std::strerror(error));
  std::string head(kHeadBytes, '\0');
  head.resize(file->read(head.data(), head.size()));
  file->seek(0);
  // other bytes than text are told by the reader, which shows none of them
  if (head.find('\0') == std::string::npos && !may_be_program(head, words_))
    fail(GcodeErrorCode::kNotProgram, 0, path);
  return file;
}

}  // namespace trn

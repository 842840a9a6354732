#include "app/daemon/privileges.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/capability.h>
#include <linux/landlock.h>
#include <seccomp.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <memory>

namespace trn {

namespace {

[[maybe_unused]] std::atomic<bool> confined = false;  // for sanitizers

constexpr unsigned kKept[] = {CAP_SYS_NICE, CAP_IPC_LOCK, CAP_NET_ADMIN};

constexpr std::uint64_t kWrites = LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_REMOVE_DIR |
                                  LANDLOCK_ACCESS_FS_REMOVE_FILE | LANDLOCK_ACCESS_FS_MAKE_CHAR |
                                  LANDLOCK_ACCESS_FS_MAKE_DIR | LANDLOCK_ACCESS_FS_MAKE_REG |
                                  LANDLOCK_ACCESS_FS_MAKE_SOCK | LANDLOCK_ACCESS_FS_MAKE_FIFO |
                                  LANDLOCK_ACCESS_FS_MAKE_BLOCK | LANDLOCK_ACCESS_FS_MAKE_SYM;

// Names as libseccomp has them; one that this processor does not have is left out.
constexpr const char* kRefused[] = {"execve",
                                    "execveat",
                                    "fork",
                                    "vfork",
                                    "ptrace",
                                    "process_vm_readv",
                                    "process_vm_writev",
                                    "kcmp",
                                    "pidfd_getfd",
                                    "mount",
                                    "umount2",
                                    "pivot_root",
                                    "chroot",
                                    "move_mount",
                                    "open_tree",
                                    "fsopen",
                                    "fsmount",
                                    "unshare",
                                    "setns",
                                    "init_module",
                                    "finit_module",
                                    "delete_module",
                                    "kexec_load",
                                    "kexec_file_load",
                                    "reboot",
                                    "swapon",
                                    "swapoff",
                                    "bpf",
                                    "perf_event_open",
                                    "userfaultfd",
                                    "keyctl",
                                    "add_key",
                                    "request_key",
                                    "settimeofday",
                                    "clock_settime",
                                    "clock_adjtime",
                                    "adjtimex",
                                    "sethostname",
                                    "setdomainname",
                                    "acct",
                                    "quotactl",
                                    "iopl",
                                    "ioperm",
                                    "personality",
                                    "setuid",
                                    "setgid",
                                    "setreuid",
                                    "setregid",
                                    "setresuid",
                                    "setresgid",
                                    "setgroups",
                                    "setfsuid",
                                    "setfsgid",
                                    "capset",
                                    "chown",
                                    "fchown",
                                    "lchown",
                                    "mknod",
                                    "mknodat",
                                    "io_uring_setup",
                                    "open_by_handle_at"};

constexpr int kFamilies[] = {AF_UNIX, AF_INET, AF_INET6, AF_CAN, AF_NETLINK};

std::string not_done(const char* what) {
  return fmt::format("{} was refused by this host: {}", what, std::strerror(errno));
}

std::uint32_t mask_of_kept(bool real_time) {
  std::uint32_t mask = 0;
  for (const unsigned capability : kKept) mask |= real_time ? 1u << capability : 0;
  return mask;
}

// The bounding set, which needs a right of its own to be made smaller, goes first.
std::string keep_capabilities(bool real_time) {
  const std::uint32_t may = mask_of_kept(real_time);
  for (unsigned capability = 0; prctl(PR_CAPBSET_READ, capability, 0, 0, 0) >= 0; ++capability)
    if (capability >= 32 || !(may >> capability & 1)) prctl(PR_CAPBSET_DROP, capability, 0, 0, 0);
  __user_cap_header_struct head{_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct data[2]{};
  if (syscall(SYS_capget, &head, data) != 0) return not_done("the look at the capabilities");
  const std::uint32_t kept = data[0].permitted & may;
  if (data[0].permitted == kept && data[1].permitted == 0) return "";  // as under its unit
  data[0] = {kept, kept, 0};
  data[1] = {0, 0, 0};
  return syscall(SYS_capset, &head, data) == 0 ? "" : not_done("the loss of capabilities");
}

int landlock_rules(const landlock_ruleset_attr* attributes, std::size_t size, unsigned flags) {
  return static_cast<int>(syscall(SYS_landlock_create_ruleset, attributes, size, flags));
}

// A folder that is not there needs no right.
bool allow_writes(int rules, const std::string& folder, std::uint64_t rights) {
  const int fd = open(folder.c_str(), O_PATH | O_CLOEXEC);
  if (fd < 0) return errno == ENOENT;
  const landlock_path_beneath_attr rule{rights, fd};
  const long added = syscall(SYS_landlock_add_rule, rules, LANDLOCK_RULE_PATH_BENEATH, &rule, 0);
  close(fd);
  return added == 0;
}

std::string keep_writes_in(const std::vector<std::string>& folders) {
  const int version = landlock_rules(nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  if (version < 1) return "this kernel has no Landlock: the daemon may write wherever its user may";
  landlock_ruleset_attr attributes{};
  attributes.handled_access_fs = kWrites;
  const int rules = landlock_rules(&attributes, sizeof attributes, 0);
  bool done = rules >= 0 && allow_writes(rules, "/dev", LANDLOCK_ACCESS_FS_WRITE_FILE);
  for (const std::string& folder : folders) done = done && allow_writes(rules, folder, kWrites);
  done = done && syscall(SYS_landlock_restrict_self, rules, 0) == 0;
  const std::string bad = done ? "" : not_done("Landlock");
  if (rules >= 0) close(rules);
  return bad;
}

using Filter = std::unique_ptr<void, decltype(&seccomp_release)>;

// Threads are made by clone with CLONE_VM and CLONE_THREAD, or by clone3, whose flags a filter cannot see:
// the C library falls back to the first where the second is not there.
bool refuse_processes(scmp_filter_ctx filter) {
  for (const char* name : {"fork", "vfork"}) {
    const int number = seccomp_syscall_resolve_name(name);
    if (number >= 0 && seccomp_rule_add(filter, SCMP_ACT_ERRNO(EPERM), number, 0) != 0) return false;
  }
  constexpr std::uint64_t kThread = 0x00010000;  // CLONE_THREAD of linux/sched.h
  return seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(clone3), 0) == 0 &&
         seccomp_rule_add(filter, SCMP_ACT_ERRNO(EPERM), SCMP_SYS(clone), 1,
                          SCMP_A0(SCMP_CMP_MASKED_EQ, kThread, 0)) == 0;
}

// The families that stay leave gaps, and a rule for each gap.
bool refuse_sockets(scmp_filter_ctx filter, bool all) {
  if (all) return seccomp_rule_add(filter, SCMP_ACT_ERRNO(EPERM), SCMP_SYS(socket), 0) == 0;
  bool done = true;
  for (int family = 0; family < AF_MAX; ++family) {
    bool kept = false;
    for (const int other : kFamilies) kept = kept || family == other;
    if (kept) continue;
    done = done && seccomp_rule_add(filter, SCMP_ACT_ERRNO(EPERM), SCMP_SYS(socket), 1,
                                    SCMP_A0(SCMP_CMP_EQ, static_cast<scmp_datum_t>(family))) == 0;
  }
  return done;
}

std::string refuse_calls(const Rights& rights) {
  const Filter filter(seccomp_init(SCMP_ACT_ALLOW), seccomp_release);
  bool done = filter && refuse_sockets(filter.get(), !rights.sockets);
  done = done && (rights.processes || refuse_processes(filter.get()));
  for (const char* name : kRefused) {
    const int number = seccomp_syscall_resolve_name(name);
    if (number < 0) continue;
    done = done && seccomp_rule_add(filter.get(), SCMP_ACT_ERRNO(EPERM), number, 0) == 0;
  }
  done = done && seccomp_load(filter.get()) == 0;
  return done ? "" : not_done("the filter of system calls");
}

}  // namespace

#if defined(__SANITIZE_ADDRESS__)
// At the end of a process the sanitizer looks for leaks through ptrace, which the filter refuses.
extern "C" __attribute__((visibility("default"))) int __lsan_is_turned_off() { return confined; }
#endif

std::vector<std::string> give_up_privileges(const Rights& rights) {
  std::vector<std::string> not_given_up;
  const auto note = [&](const std::string& bad) {
    if (!bad.empty()) not_given_up.push_back(bad);
  };
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) note(not_done("the promise to gain no rights"));
  note(keep_writes_in(rights.write_folders));
  note(keep_capabilities(rights.real_time));
  note(refuse_calls(rights));
  confined = true;
  return not_given_up;
}

}  // namespace trn

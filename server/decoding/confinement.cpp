#include "server/decoding/confinement.h"

#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstddef>
#include <fstream>
#include <vector>

#include "core/base/sanitized.h"

namespace relit::server {
namespace {

constexpr rlim_t most_descriptors = 8;  // 0 to 2, its socket, the file and its texels

#if defined(__x86_64__)
constexpr std::uint32_t this_architecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t this_architecture = AUDIT_ARCH_AARCH64;
#else
constexpr std::uint32_t this_architecture = 0;
#endif

constexpr int allowed_calls[] = {
    __NR_read,
    __NR_write,
    __NR_readv,
    __NR_writev,
    __NR_pread64,
    __NR_lseek,
    __NR_close,
    __NR_fstat,
    __NR_ftruncate,
    __NR_recvmsg,
    __NR_sendmsg,
    __NR_munmap,
    __NR_mremap,
    __NR_madvise,
    __NR_brk,
    __NR_futex,
    __NR_exit,
    __NR_exit_group,
    __NR_restart_syscall,
    __NR_rt_sigreturn,
    __NR_rt_sigaction,
    __NR_rt_sigprocmask,
    __NR_sigaltstack,
    __NR_clock_gettime,
    __NR_gettimeofday,
    __NR_getrandom,
    __NR_sched_yield,
    __NR_getpid,
    __NR_gettid,
    __NR_sysinfo,
    __NR_sched_getaffinity,
};

// Their third argument says what may be done with the memory.
constexpr int calls_with_protection[] = {__NR_mmap, __NR_mprotect};

// One sock_filter after another; jumps count instructions from the next one.
std::vector<sock_filter> filter_program() {
    const auto load = [](std::size_t offset) {
        return sock_filter BPF_STMT(BPF_LD | BPF_W | BPF_ABS, std::uint32_t(offset));
    };
    const auto answer = [](std::uint32_t action) {
        return sock_filter BPF_STMT(BPF_RET | BPF_K, action);
    };
    constexpr std::uint32_t refuse = SECCOMP_RET_ERRNO | 1;  // EPERM
    std::vector<sock_filter> program{
        load(offsetof(seccomp_data, arch)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, this_architecture, 1, 0),
        answer(SECCOMP_RET_KILL_PROCESS),
        load(offsetof(seccomp_data, nr)),
    };
    for (const int call : allowed_calls) {
        program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, std::uint32_t(call), 0, 1));
        program.push_back(answer(SECCOMP_RET_ALLOW));
    }
    for (const int call : calls_with_protection) {
        program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, std::uint32_t(call), 0, 4));
        program.push_back(load(offsetof(seccomp_data, args[2])));
        program.push_back(BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, PROT_EXEC, 0, 1));
        program.push_back(answer(refuse));
        program.push_back(answer(SECCOMP_RET_ALLOW));
    }
    program.push_back(answer(refuse));
    return program;
}

bool filter_system_calls() {
    if (this_architecture == 0) return false;
    auto program = filter_program();
    const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
    return ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) == 0;
}

void limit(int resource, rlim_t value) {
    const rlimit both{value, value};
    ::setrlimit(__rlimit_resource(resource), &both);
}

}  // namespace

std::uint64_t address_space_bytes() {
    std::ifstream file("/proc/self/statm");
    std::uint64_t pages = 0;
    file >> pages;
    return pages * std::uint64_t(::sysconf(_SC_PAGESIZE));
}

bool confine(const DecodeAllowance& allowance, std::uint64_t used_bytes) {
    // Sanitizers map terabytes for their shadows, which no limit on address space could tell apart.
    if (!sanitized) limit(RLIMIT_AS, used_bytes + allowance.memory_bytes);
    limit(RLIMIT_FSIZE, allowance.file_bytes);
    limit(RLIMIT_CPU, allowance.cpu_s);
    limit(RLIMIT_CORE, 0);
    limit(RLIMIT_NOFILE, most_descriptors);
    ::prctl(PR_SET_DUMPABLE, 0);
    return ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && filter_system_calls();
}

}  // namespace relit::server

// What a process that reads hostile bytes is left with. Linux.
#pragma once

#include <cstdint>

#include "server/decoding/messages.h"

namespace relit::server {

/// Bytes of address space that this process has now.
[[nodiscard]] std::uint64_t address_space_bytes();

/// Confines this process for good: limits on memory, processor time and file size, no core dump, no
/// new descriptors beyond the eight that a job needs, no new privileges, and of the system calls only those on
/// memory, on its descriptors and on time. Others fail with EPERM: no file can be opened, no socket
/// made, no process started or signalled, and no memory made executable.
///
/// @return whether the kernel filters the system calls; where it does not (another processor than
///         x86-64 and ARM64, a kernel without seccomp) the limits hold all the same
/// @param used_bytes  the address space that the allowance comes on top of
[[nodiscard]] bool confine(const DecodeAllowance& allowance, std::uint64_t used_bytes);

}  // namespace relit::server

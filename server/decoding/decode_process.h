// The life of a process that decodes images.
#pragma once

#include "server/decoding/messages.h"

namespace relit::server {

/// Confines itself and does the jobs that come over `socket`, until its other end is gone.
/// @return the exit status
[[nodiscard]] int run_decode_process(int socket, const DecodeAllowance& allowance);

}  // namespace relit::server

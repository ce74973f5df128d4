// The helper: relitd once more, with no thread at work but its own and nothing but the decoders set up, that
// makes processes for images by forking itself. The server cannot: a fork of many threads inherits
// their locks. Started by DecodePool, ended by the end of its socket.
#pragma once

namespace relit::server {

/// Serves the orders that come over decode_helper_socket until its other end is gone, be it by kill
/// -9 of the server; all its processes are gone then too.
/// @return the exit status: 2 where there is no such socket (it was started by hand)
[[nodiscard]] int run_decode_helper();

}  // namespace relit::server

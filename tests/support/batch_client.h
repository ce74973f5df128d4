// A client of batches that goes on whatever happens to the server: it repeats what was not answered, and
// comes back to streams that were cut.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <string>

namespace relit::test {

/// Where the server is now; 0 while it is not there.
using CurrentPort = std::function<int()>;

/// Posts until it is answered 202, always with the same key. @return the batch's id
/// @throws std::runtime_error for an answer that repeating does not change
[[nodiscard]] std::string submit_until_accepted(const CurrentPort& port, const std::string& body,
                                                const std::string& key);

/// What a batch's events said until its end.
struct SeenEvents {
    std::map<int, std::string> frames;  ///< number -> "done" or "failed"
    int reconnected = 0;                ///< streams after the first
    std::string faults;                 ///< events twice, or out of order; empty: none
};

/// Follows a batch's events to their end, from server to server.
[[nodiscard]] SeenEvents follow_events(const CurrentPort& port, const std::string& batch);

}  // namespace relit::test

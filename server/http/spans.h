// How long the stages of a request took: for its Server-Timing, its line of the log and whoever asks
// why it was slow.
#pragma once

#include <chrono>
#include <string_view>
#include <vector>

namespace relit::server {

struct Span {
    std::string_view stage;  ///< a constant
    std::chrono::duration<double, std::milli> took;
};

/// In the order in which they ended.
using Spans = std::vector<Span>;

}  // namespace relit::server

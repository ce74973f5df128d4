// Writes lines to a descriptor on a thread of its own: nobody who has something to say waits for a
// disk, a terminal or whoever reads the other end of a pipe.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace relit::server {

class LineWriter {
public:
    struct Settings {
        int descriptor = 2;                ///< not closed
        std::size_t max_bytes = 8u << 20;  ///< that wait to be written; lines beyond are lost
        /// Makes the line that tells how many were lost, with its end.
        std::function<std::string(std::uint64_t lost)> tell_lost;
    };

    explicit LineWriter(Settings settings);
    ~LineWriter();  ///< flush(), for a second; what nobody takes until then is lost
    LineWriter(const LineWriter&) = delete;
    LineWriter& operator=(const LineWriter&) = delete;

    /// Has a line written, its end included, after those before it. Never waits. From any thread.
    void add(std::string_view line);

    /// Waits until all that was added is written. @return false: it is not, after `patience`
    bool flush(std::chrono::milliseconds patience);

private:
    struct State;
    static void write(const std::shared_ptr<State>& state);
    std::shared_ptr<State> state_;  // the thread's too, which may hang in its last write
};

}  // namespace relit::server

#include "server/logging/line_writer.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <set>
#include <thread>
#include <vector>

namespace relit::server {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// A pipe whose two ends are closed at the end, unless before.
struct Pipe {
    Pipe() { EXPECT_EQ(::pipe2(ends, O_CLOEXEC), 0); }
    ~Pipe() {
        close(0);
        close(1);
    }
    Pipe(const Pipe&) = delete;
    Pipe& operator=(const Pipe&) = delete;
    void close(int end) {
        if (ends[end] >= 0) ::close(std::exchange(ends[end], -1));
    }
    // What is there, at least a byte; nothing at the end.
    std::string read_some() {
        char data[65536];
        const auto size = ::read(ends[0], data, sizeof data);
        return {data, std::size_t(std::max<ssize_t>(size, 0))};
    }
    // All until `text` is the end of it.
    std::string read_until(std::string_view text) {
        std::string all;
        for (std::string piece = " "; !all.ends_with(text) && !piece.empty(); all += piece)
            piece = read_some();
        return all;
    }
    int ends[2] = {-1, -1};
};

LineWriter::Settings settings_for(const Pipe& pipe, std::size_t max_bytes = 8u << 20) {
    return {.descriptor = pipe.ends[1],
            .max_bytes = max_bytes,
            .tell_lost = [](std::uint64_t lost) { return std::to_string(lost) + " lost\n"; }};
}

TEST(LineWriter, WritesLinesWholeAndInTheOrderOfEachThread) {
    Pipe pipe;
    LineWriter writer(settings_for(pipe));
    std::vector<std::jthread> threads;
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&writer, t] {
            for (int i = 0; i < 1000; ++i)
                writer.add(std::to_string(t) + " " + std::to_string(i) + "\n");
        });
    std::jthread last([&] {
        threads.clear();
        writer.add("end\n");
    });
    const std::string all = pipe.read_until("end\n");
    std::vector<int> next(4, 0);
    std::size_t begin = 0;
    for (std::size_t end = 0; (end = all.find('\n', begin)) != std::string::npos; begin = end + 1) {
        const std::string line = all.substr(begin, end - begin);
        if (line == "end") continue;
        const int thread = line[0] - '0';
        EXPECT_EQ(line.substr(2), std::to_string(next.at(std::size_t(thread))++)) << line;
    }
    EXPECT_EQ(next, std::vector<int>(4, 1000));
}

TEST(LineWriter, NobodyWaitsForAReaderThatDoesNotReadAndTheLinesLostAreCounted) {
    Pipe pipe;
    LineWriter writer(settings_for(pipe, 1 << 20));
    const std::string line = std::string(1023, 'x') + '\n';
    const auto start = Clock::now();
    for (int i = 0; i < 4096; ++i) writer.add(line);  // 4 MiB; a pipe takes 64 KiB
    EXPECT_LT(Clock::now() - start, 5s);
    EXPECT_FALSE(writer.flush(10ms));
    std::size_t written = 0, lost = 0;
    // How many are lost is told more than once where the writing thread began before all were added.
    for (std::string rest; written + lost < 4096;) {
        const std::string piece = pipe.read_some();
        ASSERT_NE(piece, "");
        rest += piece;
        for (auto end = rest.find('\n'); end != std::string::npos; end = rest.find('\n')) {
            if (rest.starts_with('x')) ++written;
            else lost += std::stoul(rest);
            rest.erase(0, end + 1);
        }
    }
    EXPECT_EQ(written + lost, 4096u);
    EXPECT_GE(written, 1024u) << "what there is room for is kept";
    EXPECT_TRUE(writer.flush(10s));
}

TEST(LineWriter, EndsThoughNobodyReads) {
    Pipe pipe;
    const auto start = Clock::now();
    {
        LineWriter writer(settings_for(pipe));
        writer.add(std::string(1 << 20, 'x'));
    }
    EXPECT_LT(Clock::now() - start, 5s);
    pipe.close(0);      // which ends the write that still waits
    pipe.ends[1] = -1;  // and whose this end is
}

TEST(LineWriter, OutlivesItsReader) {
    Pipe pipe;
    LineWriter writer(settings_for(pipe));
    pipe.close(0);
    writer.add("nobody reads this\n");
    EXPECT_TRUE(writer.flush(10s));
    writer.add("nor this\n");
    EXPECT_TRUE(writer.flush(10s));
}

}  // namespace
}  // namespace relit::server

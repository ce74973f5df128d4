// How far the work is, told by who does it and drawn by who waits for it: a line on stderr, on
// terminals alone, once the work takes longer than half a second.
#pragma once

#include <chrono>
#include <mutex>
#include <optional>
#include <string>

namespace relit::cli {

class Progress {
public:
    /// A new stage, without a known share: "reading", "rendering".
    void begin(std::string stage);

    /// The share of the stage that is done, 0 to 1.
    void reach(double share);

    /// How many frames of the stage are done: the line tells their rate too.
    void count(int done, int total);

    /// A line on stderr that stays; nothing when quiet.
    void say(const std::string& line);

    /// The same of what went wrong: also when quiet.
    void complain(const std::string& line);

    /// Nothing is drawn or said from now on.
    void be_quiet();

    /// Draws the line as it is now, where there is something to draw on.
    void draw();

    /// Takes the line away, for good.
    void end();

private:
    using Clock = std::chrono::steady_clock;
    void write_line(const std::string& line);
    [[nodiscard]] std::string line(Clock::time_point now) const;
    void clear();

    std::mutex mutex_;
    std::string stage_;
    std::optional<double> share_;
    std::string count_;  // "129 of 300", with their rate; empty where nothing is counted
    Clock::time_point stage_began_{};
    const Clock::time_point began_ = Clock::now();
    bool drawn_ = false;
    bool quiet_ = false;
    bool ended_ = false;
};

}  // namespace relit::cli

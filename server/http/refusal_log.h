// What the log says of connections that are refused before they are served: of each reason a line
// when it begins, then at most one in every `pause`, so that a flood of connections is no flood of lines.
// For the thread that accepts.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string_view>

namespace relit::server {

class RefusalLog {
public:
    using Clock = std::chrono::steady_clock;
    static constexpr std::chrono::seconds pause{10};

    /// One more. @return how many a line is to tell of, those since the last line; 0: no line now
    /// @param reason  a setting or an error's code; outlives this
    [[nodiscard]] std::uint64_t count(std::string_view reason, Clock::time_point now) {
        Told& told = told_[reason];
        ++told.untold;
        if (now < told.quiet_until) return 0;
        told.quiet_until = now + pause;
        const std::uint64_t untold = told.untold;
        told.untold = 0;
        return untold;
    }

private:
    struct Told {
        Clock::time_point quiet_until{};
        std::uint64_t untold = 0;
    };
    std::map<std::string_view, Told> told_;
};

}  // namespace relit::server

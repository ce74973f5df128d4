#include "clients/cli/progress.h"

#include <spdlog/fmt/fmt.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace relit::cli {
namespace {

using namespace std::chrono_literals;

constexpr auto patience = 500ms;
constexpr int bar_width = 24;

// From when on the share that is done says how long the rest takes.
constexpr double telling_share = 0.02;
constexpr auto telling_time = 1s;

// The terminal may be gone or full: drawing is no reason to fail.
void write_to_stderr(const std::string& text) {
    [[maybe_unused]] const auto written = ::write(STDERR_FILENO, text.data(), text.size());
}

std::size_t terminal_width() {
    winsize size{};
    const bool known = ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
    return known ? size.ws_col : 80;
}

// "0:07", "12:30", "1:02:03"
std::string clock_text(std::chrono::duration<double> time) {
    const auto s = std::int64_t(time.count());
    return s < 3600 ? fmt::format("{}:{:02}", s / 60, s % 60)
                    : fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

// ", 10.3 a second", ", 4.2 s each"; nothing before it can be told
std::string rate_text(int done, double taken_s) {
    if (done == 0 || taken_s <= 0) return "";
    return done >= taken_s ? fmt::format(", {:.1f} a second", done / taken_s)
                           : fmt::format(", {:.1f} s each", taken_s / done);
}

}  // namespace

void Progress::begin(std::string stage) {
    const std::lock_guard lock(mutex_);
    stage_ = std::move(stage);
    share_.reset();
    count_.clear();
    stage_began_ = Clock::now();
}

void Progress::reach(double share) {
    const std::lock_guard lock(mutex_);
    share_ = share;
}

void Progress::count(int done, int total) {
    const std::lock_guard lock(mutex_);
    share_ = double(done) / std::max(total, 1);
    const std::chrono::duration<double> taken = Clock::now() - stage_began_;
    count_ = fmt::format(", {} of {}{}", done, total, rate_text(done, taken.count()));
}

void Progress::say(const std::string& line) {
    const std::lock_guard lock(mutex_);
    if (!quiet_) write_line(line);
}

void Progress::complain(const std::string& line) {
    const std::lock_guard lock(mutex_);
    write_line(line);
}

void Progress::write_line(const std::string& line) {
    clear();
    write_to_stderr(line + "\n");
}

void Progress::be_quiet() {
    const std::lock_guard lock(mutex_);
    quiet_ = true;
}

void Progress::draw() {
    const std::lock_guard lock(mutex_);
    const auto now = Clock::now();
    if (quiet_ || ended_ || stage_.empty() || now - began_ < patience) return;
    if (!::isatty(STDERR_FILENO)) return;
    write_to_stderr("\r\x1b[K" + line(now).substr(0, terminal_width() - 1));
    drawn_ = true;
}

void Progress::end() {
    const std::lock_guard lock(mutex_);
    clear();
    ended_ = true;
}

void Progress::clear() {
    if (drawn_) write_to_stderr("\r\x1b[K");
    drawn_ = false;
}

// "rendering  43 % [##########..............] 0:12, 0:16 left, 129 of 300, 10.7 a second"
std::string Progress::line(Clock::time_point now) const {
    const std::string elapsed = clock_text(now - began_);
    if (!share_) return fmt::format("{} {}", stage_, elapsed);
    const int full = int(*share_ * bar_width);
    std::string text = fmt::format("{} {:3.0f} % [{}{}] {}", stage_, std::floor(*share_ * 100),
                                   std::string(std::size_t(full), '#'),
                                   std::string(std::size_t(bar_width - full), '.'), elapsed);
    const auto taken = now - stage_began_;
    if (*share_ >= telling_share && taken >= telling_time)
        text += fmt::format(", {} left", clock_text(taken * ((1 - *share_) / *share_)));
    return text + count_;
}

}  // namespace relit::cli

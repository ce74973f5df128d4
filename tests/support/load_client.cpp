#include "tests/support/load_client.h"

#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <deque>
#include <memory>
#include <stdexcept>
#include <string_view>

#include "tests/support/http_client.h"

namespace relit::test {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds most_late{50};

double seconds_between(Clock::time_point a, Clock::time_point b) {
    return std::chrono::duration<double>(b - a).count();
}

double cpu_of_thread() {
    rusage usage{};
    ::getrusage(RUSAGE_THREAD, &usage);
    const auto seconds = [](const timeval& time) {
        return double(time.tv_sec) + 1e-6 * double(time.tv_usec);
    };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// One connection with at most one request on its way. Of replies the head is kept, bodies are counted.
class Line {
public:
    Line(int port, int epoll) : socket_(connected_socket(port)) {
        epoll_event event{.events = EPOLLIN, .data = {.ptr = this}};
        ::epoll_ctl(epoll, EPOLL_CTL_ADD, socket_, &event);
    }
    ~Line() { ::close(socket_); }
    Line(const Line&) = delete;
    Line& operator=(const Line&) = delete;

    void send(std::string_view request) {
        sent_ = Clock::now();
        busy_ = true;
        head_size_ = body_left_ = 0;
        if (::send(socket_, request.data(), request.size(), MSG_NOSIGNAL) != ssize_t(request.size()))
            broken_ = true;
    }

    // Reads what is there. @return whether the reply is whole or will never be
    bool receive() {
        const auto size =
            ::recv(socket_, data_.data() + head_size_, data_.size() - head_size_, MSG_DONTWAIT);
        if (size < 0 && errno == EAGAIN) return false;
        if (size <= 0) return broken_ = true;
        if (body_left_ > 0) {
            body_left_ -= std::min(body_left_, std::size_t(size));
            return body_left_ == 0;
        }
        head_size_ += std::size_t(size);
        const std::string_view text(data_.data(), head_size_);
        const auto end = text.find("\r\n\r\n");
        if (end == std::string_view::npos) return broken_ = head_size_ == data_.size();
        read_head(text.substr(0, end));
        const std::size_t whole = end + 4 + length_;
        body_left_ = whole > head_size_ ? whole - head_size_ : 0;
        head_size_ = 0;
        return body_left_ == 0;
    }

    [[nodiscard]] Clock::time_point sent() const { return sent_; }
    [[nodiscard]] bool broken() const { return broken_; }
    [[nodiscard]] bool busy() const { return busy_; }
    void rest() { busy_ = false; }
    [[nodiscard]] int status() const { return status_; }
    [[nodiscard]] bool may_retry() const { return may_retry_; }

private:
    void read_head(std::string_view head) {
        constexpr std::string_view name = "\r\nContent-Length: ";
        status_ = 0;
        length_ = 0;
        std::from_chars(head.data() + 9, head.data() + 12, status_);
        if (const auto at = head.find(name); at != std::string_view::npos)
            std::from_chars(head.data() + at + name.size(), head.data() + head.size(), length_);
        may_retry_ = head.find("\r\nRetry-After: ") != std::string_view::npos;
    }

    int socket_;
    Clock::time_point sent_;
    std::array<char, 16384> data_;
    std::size_t head_size_ = 0;
    std::size_t body_left_ = 0;
    std::size_t length_ = 0;
    int status_ = 0;
    bool may_retry_ = false;
    bool busy_ = false;  // with a request
    bool broken_ = false;
};

class Load {
public:
    explicit Load(const LoadSettings& settings)
        : settings_(settings), epoll_(::epoll_create1(EPOLL_CLOEXEC)) {
        const auto expected = std::size_t(settings.per_second * settings.duration.count()) + 1;
        result_.admitted.reserve(expected);
        result_.refused.reserve(expected);
    }
    ~Load() { ::close(epoll_); }
    Load(const Load&) = delete;
    Load& operator=(const Load&) = delete;

    LoadResult run() {
        const double cpu = cpu_of_thread();
        begin_ = Clock::now();
        const auto period = std::chrono::duration<double>(1 / settings_.per_second);
        const auto end = begin_ + std::chrono::duration_cast<Clock::duration>(settings_.duration);
        for (long number = 0;; ++number) {
            const auto due =
                begin_ + std::chrono::duration_cast<Clock::duration>(double(number) * period);
            if (due >= end) break;
            receive_until(due);
            if (Clock::now() - due > most_late) ++result_.not_sent;  // the machine stood still
            else send_one();
        }
        while (free_.size() < lines_.size()) {
            const auto before = result_.admitted.size() + result_.refused.size();
            receive_until(Clock::now() + std::chrono::seconds(10), /*any=*/true);
            if (result_.admitted.size() + result_.refused.size() == before &&
                free_.size() < lines_.size() && ++silent_ > 3)
                throw std::runtime_error("no answer for long");
        }
        result_.seconds = seconds_between(begin_, Clock::now());
        result_.client_cpu_s = cpu_of_thread() - cpu;
        return std::move(result_);
    }

private:
    void send_one() {
        if (free_.empty() && int(lines_.size()) == settings_.connections) {
            ++result_.not_sent;
            return;
        }
        if (free_.empty()) {
            lines_.push_back(std::make_unique<Line>(settings_.port, epoll_));
            free_.push_back(lines_.back().get());
        }
        Line* const line = free_.front();  // in turn: none is idle for so long that it is closed
        free_.pop_front();
        line->send(settings_.request);
    }

    // Takes what comes until then, or the first that comes.
    void receive_until(Clock::time_point due, bool any = false) {
        for (;;) {
            const auto left = std::max(due - Clock::now(), Clock::duration::zero());
            const auto ns = std::chrono::duration_cast<std::chrono::nanoseconds>(left).count();
            const timespec patience{.tv_sec = ns / 1'000'000'000, .tv_nsec = ns % 1'000'000'000};
            std::array<epoll_event, 64> events;
            const int count =
                ::epoll_pwait2(epoll_, events.data(), int(events.size()), &patience, nullptr);
            for (int i = 0; i < count; ++i)
                take(static_cast<Line*>(events[std::size_t(i)].data.ptr));
            if (Clock::now() >= due || (any && count > 0)) return;
        }
    }

    void take(Line* line) {
        if (!line->receive()) return;
        if (!line->busy()) return drop(line);  // it was idle for too long
        const auto now = Clock::now();
        const LoadResult::Answer answer{seconds_between(begin_, line->sent()),
                                        1000 * seconds_between(line->sent(), now)};
        if (line->broken() || (line->status() != 200 && line->status() != 503) ||
            (line->status() == 503 && !line->may_retry()))
            ++result_.others;
        else (line->status() == 200 ? result_.admitted : result_.refused).push_back(answer);
        line->rest();
        if (line->broken()) drop(line);
        else free_.push_back(line);
    }

    void drop(Line* line) {
        std::erase(free_, line);
        std::erase_if(lines_, [&](const auto& it) { return it.get() == line; });
    }

    const LoadSettings& settings_;
    const int epoll_;
    Clock::time_point begin_;
    std::vector<std::unique_ptr<Line>> lines_;
    std::deque<Line*> free_;
    LoadResult result_;
    int silent_ = 0;
};

}  // namespace

LoadResult run_load(const LoadSettings& settings) { return Load(settings).run(); }

double quantile_ms(const std::vector<LoadResult::Answer>& answers, double part) {
    if (answers.empty()) return 0;
    std::vector<double> times;
    times.reserve(answers.size());
    for (const auto& answer : answers) times.push_back(answer.took_ms);
    const auto place = std::size_t(std::ceil(part * double(times.size()))) - 1;
    std::nth_element(times.begin(), times.begin() + std::ptrdiff_t(place), times.end());
    return times[place];
}

}  // namespace relit::test

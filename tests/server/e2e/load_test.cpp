// What the real program bears: clients that leave in the middle of a render, and long drags. Its
// processor time and memory are read from /proc.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "core/base/sanitized.h"
#include "tests/support/http_client.h"
#include "tests/support/maps.h"
#include "tests/support/metrics_text.h"
#include "tests/support/relit_process.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// The fields of /proc/<pid>/stat, numbered as in proc(5).
long stat_field(const RelitProcess& relitd, int number) {
    std::ifstream file("/proc/" + std::to_string(relitd.pid()) + "/stat");
    std::string line;
    std::getline(file, line);
    std::istringstream rest(line.substr(line.rfind(')') + 1));
    std::string word;
    for (int field = 3; field <= number; ++field) rest >> word;
    return std::stol(word);
}

std::chrono::milliseconds processor_time(const RelitProcess& relitd) {
    const long ticks = stat_field(relitd, 14) + stat_field(relitd, 15);
    return std::chrono::milliseconds(ticks * 1000 / ::sysconf(_SC_CLK_TCK));
}

double memory_mib(const RelitProcess& relitd) {
    return double(stat_field(relitd, 24)) * double(::sysconf(_SC_PAGESIZE)) / (1 << 20);
}

std::string upload(int port, const std::string& image) {
    const HttpReply reply = http(port, "POST", "/v1/images", image);
    EXPECT_EQ(reply.status, 201) << reply.body;
    return reply.body.substr(reply.body.find(':') + 2, 64);
}

// Waits until so many renders have a slot.
void wait_for_running(int port, int count) {
    const auto deadline = Clock::now() + 10s;
    while (metric_of(port, "relit_renders_running") != count)
        if (Clock::now() > deadline) throw std::runtime_error("not so many renders");
        else std::this_thread::sleep_for(1ms);
}

// In pairs, for two threads render two pictures at once: every client has a slot when it leaves.
TEST(Load, ThousandClientsThatLeaveInTheirRendersLeaveTheProcessorIdle) {
    RelitProcess relitd({.flags = {"--max-renders=2", "--threads=2", "--log-level=warn"}});
    const int port = relitd.port();
    const std::string id = upload(port, small_png(1, 128, 128));
    std::string lights = R"({"type": "point"})";  // a render takes long enough for all to come in
    for (int light = 1; light < 32; ++light) lights += R"(, {"type": "point"})";
    const std::string request =
        http_request("POST", "/v1/render",
                     R"({"height": {"image": ")" + id + R"("}, "lights": [)" + lights +
                         R"(], "material": {"illumination": "count", "steps": 10000}})");
    for (int pair = 0; pair < 500; ++pair) {
        wait_for_running(port, 0);
        RawConnection one(port);
        RawConnection other(port);
        one.send(request);
        other.send(request);
        wait_for_running(port, 2);
    }
    std::this_thread::sleep_for(sanitized ? 3s : 100ms);
    const auto before = processor_time(relitd);
    std::this_thread::sleep_for(500ms);
    const auto used = processor_time(relitd) - before;
    RecordProperty("processor_ms_in_the_500_after", int(used.count()));
    EXPECT_LE(used, sanitized ? 100ms : 20ms) << "of 1000 that two threads have in 500 ms";
    EXPECT_EQ(metric_of(port, "relit_renders_running"), 0);
    EXPECT_EQ(metric_of(port, "relit_renders_waiting"), 0);
    EXPECT_EQ(metric_of(port, R"(relit_renders_total{result="cancelled"})"), 1000);
    EXPECT_EQ(metric_of(port, R"(relit_renders_total{result="done"})"), 0);
}

// One client's drag over a small map: random lights, the same for the same seed.
class Drag {
public:
    Drag(int port, const std::string& id, std::uint64_t seed)
        : connection_(port), id_(id), random_(seed) {}

    // @return the longest time from a request to its picture
    Clock::duration run(int frames) {
        Clock::duration longest{};
        for (int frame = 0; frame < frames; ++frame) {
            const auto start = Clock::now();
            connection_.send(http_request("POST", "/v1/render", next_scene()));
            const HttpReply reply = connection_.receive();
            longest = std::max(longest, Clock::now() - start);
            good_ += reply.status == 200 && reply.body.substr(1, 3) == "PNG" ? 1 : 0;
        }
        return longest;
    }
    [[nodiscard]] int good() const { return good_; }

private:
    std::string next_scene() {
        const auto coordinate = [&] { return std::to_string(2 * random_() - 1); };
        const std::string x = coordinate(), y = coordinate();
        return R"({"height": {"image": ")" + id_ +
               R"("}, "light": {"type": "point", "position": [)" + x + ", " + y + R"(, 0.6]}})";
    }

    RawConnection connection_;
    std::string id_;
    Random random_;
    int good_ = 0;
};

void expect_flat(double before_mib, double after_mib) {
    if (sanitized) return;
    EXPECT_LE(after_mib, 1.05 * before_mib) << before_mib << " MiB before";
}

// With a sanitizer fewer frames, and no claims of time and memory.
constexpr int frames = sanitized ? 800 : 10'000;
constexpr int warm_up =
    sanitized ? 80 : 1'000;  // every thread has its buffers, the allocator its arenas

// 32 x 32 texels and as many pixels: a frame takes about half a millisecond, so that the test is
// about the server and 10,000 of them end within some 7 s.
std::string drag_map() { return small_png(1, 32, 32); }

TEST(Load, TenThousandDragFramesThroughOneConnectionTakeNoMemory) {
    RelitProcess relitd({.flags = {"--threads=2", "--log-level=warn"}});
    Drag drag(relitd.port(), upload(relitd.port(), drag_map()), 1);
    drag.run(warm_up);
    const double before = memory_mib(relitd);
    const auto start = Clock::now();
    drag.run(frames);
    const auto took = std::chrono::duration<double>(Clock::now() - start).count();
    EXPECT_EQ(drag.good(), warm_up + frames);
    expect_flat(before, memory_mib(relitd));
    std::cout << frames / took << " frames/s; memory " << before << " -> " << memory_mib(relitd)
              << " MiB\n";
}

// What each of the eight drags had when the first was done, and the longest anybody waited.
TEST(Load, TenThousandDragFramesThroughEightConnectionsTakeNoMemoryAndStarveNobody) {
    constexpr int clients = 8;
    RelitProcess relitd({.flags = {"--threads=2", "--log-level=warn"}});
    const std::string id = upload(relitd.port(), drag_map());
    std::vector<std::unique_ptr<Drag>> drags;
    for (int k = 0; k < clients; ++k)
        drags.push_back(std::make_unique<Drag>(relitd.port(), id, std::uint64_t(k)));
    std::vector<double> seconds(clients), longest_ms(clients);
    const auto run_all = [&](int frames_each) {
        std::vector<std::jthread> threads;
        const auto start = Clock::now();
        for (std::size_t k = 0; k < clients; ++k)
            threads.emplace_back([&, k] {
                const auto longest = drags[k]->run(frames_each);
                longest_ms[k] = std::chrono::duration<double, std::milli>(longest).count();
                seconds[k] = std::chrono::duration<double>(Clock::now() - start).count();
            });
    };
    run_all(warm_up / clients);
    const double before = memory_mib(relitd);
    run_all(frames / clients);
    expect_flat(before, memory_mib(relitd));
    for (const auto& drag : drags) EXPECT_EQ(drag->good(), (warm_up + frames) / clients);
    const auto [fastest, slowest] = std::minmax_element(seconds.begin(), seconds.end());
    const double longest = *std::max_element(longest_ms.begin(), longest_ms.end());
    if (!sanitized) {
        EXPECT_LE(*slowest, 1.25 * *fastest) << "the same work, in the order of arrival";
        EXPECT_LE(longest, 500) << "ms for one frame";
    }
    std::cout << frames / *slowest << " frames/s; fastest " << *fastest << " s, slowest "
              << *slowest << " s; longest frame " << longest << " ms; memory " << before << " -> "
              << memory_mib(relitd) << " MiB\n";
}

}  // namespace
}  // namespace relit::test

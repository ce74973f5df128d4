// The pool with the real helper and its processes; hostile to them from outside, as a broken decoder would
// be from inside: they are killed while they decode.
#include "server/decoding/decode_pool.h"

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstring>
#include <functional>
#include <memory>
#include <thread>

#include "server/error_codes.h"
#include "tests/support/data.h"
#include "tests/support/processes.h"
#include "tests/support/upload_images.h"

namespace relit::server {
namespace {

using namespace std::chrono_literals;
using namespace relit::test;
using Clock = std::chrono::steady_clock;

// Takes a decoder half a second, and 256 MB of floats.
const std::string& large_png() {
    static const std::string bytes = encoded(Image(8000, 8000, 1, 0.25f));
    return bytes;
}

class Pool : public testing::Test {
protected:
    Pool() { spdlog::set_level(spdlog::level::off); }

    DecodePool& pool(DecodePoolSettings settings = {}) {
        settings.program = RELITD_PATH;
        pool_ = std::make_unique<DecodePool>(settings, metrics_);
        return *pool_;
    }
    void end_pool() { pool_.reset(); }
    [[nodiscard]] std::uint64_t count(DecodeResult result) const {
        return metrics_.decodes[std::size_t(result)];
    }

    Metrics metrics_;
    std::unique_ptr<DecodePool> pool_;
};

std::string refusal(const std::function<void()>& work) {
    try {
        work();
    } catch (const Error& error) {
        return std::string(error.code) + ": " + error.what();
    }
    return "accepted";
}

std::vector<std::string> files_of_every_format() {
    const auto sample = [](const char* name) {
        return read_file(std::string(RELIT_SOURCE_DIR) + "/server/samples/" + name);
    };
    Image colour(70, 50, 4);
    for (std::size_t i = 0; i < colour.values.size(); ++i)
        colour.values[i] = float(i * 37 % 101) / 100.0f;
    return {sample("plato.png"),
            sample("st-helens.tif"),
            sample("rainbow.hdr"),
            encoded(colour, {.format = PictureFormat::webp}),
            encoded(colour, {.format = PictureFormat::exr, .bit_depth = 32}),
            encoded(Image(70, 50, 3, 0.3f), {.format = PictureFormat::jpeg})};
}

bool same(const DecodedImage& a, const DecodedImage& b) {
    return a.info.format == b.info.format && a.info.type == b.info.type &&
           a.info.has_alpha == b.info.has_alpha && a.info.associated == b.info.associated &&
           a.image.width == b.image.width && a.image.height == b.image.height &&
           a.image.channels == b.image.channels && a.image.values.size() == b.image.values.size() &&
           std::memcmp(a.image.values.data(), b.image.values.data(),
                       a.image.values.size() * sizeof(float)) == 0;
}

TEST_F(Pool, GivesWhatDecodeGivesBitForBit) {
    DecodePool& decoding = pool();
    for (int round = 0; round < 30; ++round)  // the processes are used again
        for (const std::string& file : files_of_every_format()) {
            EXPECT_TRUE(same(decoding.decode(file, {}), decode(file)));
            if (round % 10 == 0) {
                EXPECT_EQ(decoding.check(file, {}).width, decode(file).info.width);
            }
        }
    EXPECT_EQ(count(DecodeResult::crashed), 0u);
    EXPECT_EQ(count(DecodeResult::done), 30u * 6 + 3 * 6);
}

TEST_F(Pool, RefusesInTheWordsOfDecode) {
    DecodePool& decoding = pool({.limits = {.max_pixels = 5000}});
    const std::string files[] = {"hello", small_png().substr(0, 100), lying_png(0, 10, false),
                                 lying_png(100'000, 100'000, true), small_png(1, 80, 80)};
    for (const std::string& file : files) {
        const std::string here =
            refusal([&] { (void)decode(file, DecodeLimits{.max_pixels = 5000}); });
        EXPECT_NE(here, "accepted");
        EXPECT_EQ(refusal([&] { (void)decoding.decode(file, {}); }), here);
        EXPECT_EQ(refusal([&] { (void)decoding.check(file, {}); }), here);
    }
    EXPECT_EQ(decoding.check(small_png(), {}).width, 16);
    EXPECT_EQ(count(DecodeResult::refused), 10u);
}

TEST_F(Pool, ADecoderThatDiesCostsItsImageAlone) {
    DecodePool& decoding = pool();
    for (int round = 0; round < 3; ++round) {
        std::string answer;
        std::jthread client(
            [&] { answer = refusal([&] { (void)decoding.check(large_png(), {}); }); });
        const pid_t busy = halted_decoder_of(::getpid());
        ASSERT_NE(busy, 0);
        EXPECT_EQ(decoding.check(small_png(), {}).width, 16) << "others go on meanwhile";
        ::kill(busy, round == 0 ? SIGSEGV : SIGKILL);
        ::kill(busy, SIGCONT);
        client.join();
        EXPECT_EQ(answer, "image-broken: the png file broke its decoder");
        EXPECT_TRUE(same(decoding.decode(small_png(), {}), decode(small_png())));
    }
    EXPECT_EQ(count(DecodeResult::crashed), 3u);
}

TEST_F(Pool, IdleProcessesAndTheHelperMayDieWithoutAnybodyNoticing) {
    DecodePool& decoding = pool({.workers = 3});
    (void)decoding.check(small_png(), {});
    for (int round = 0; round < 4; ++round) {
        const auto [helpers, workers] = decoding_processes_of(::getpid());
        ASSERT_EQ(helpers.size(), 1u);
        const bool all = round % 2 == 1;
        if (all) ::kill(helpers.front().pid, SIGKILL);
        else
            for (const ProcessFacts& worker : workers) ::kill(worker.pid, SIGKILL);
        std::this_thread::sleep_for(round < 2 ? 0ms : 50ms);
        EXPECT_EQ(refusal([&] { (void)decoding.check(small_png(round), {}); }), "accepted");
    }
    EXPECT_EQ(count(DecodeResult::crashed), 0u);
}

TEST_F(Pool, AHangIsEndedByDecodeTimeout) {
    DecodePool& decoding = pool({.timeout = 150ms});
    (void)large_png();  // the file is made before time counts
    const auto begin = Clock::now();
    EXPECT_EQ(refusal([&] { (void)decoding.check(large_png(), {}); }),
              "too-costly: decoding the image takes longer than 0.15 s (decode-timeout)");
    EXPECT_LT(Clock::now() - begin, 1s);
    EXPECT_TRUE(comes_true([] {  // the one that was at it is gone, not only forgotten
        for (const ProcessFacts& worker : decoding_processes_of(::getpid()).workers)
            if (worker.cpu_s > 0.08 || worker.state == 'R') return false;
        return true;
    }));
    EXPECT_EQ(count(DecodeResult::too_costly), 1u);
}

TEST_F(Pool, WhoeverWaitsNoLongerEndsTheDecoder) {
    DecodePool& decoding = pool({.workers = 1});
    (void)decoding.check(small_png(), {});  // there is a process by now, to be waited for
    (void)large_png();                      // and the file is made
    EXPECT_EQ(refusal([&] {
                  (void)decoding.check(large_png(), {{}, Clock::now() + 100ms});
              }),
              "timed-out: the image was not decoded in time (render-timeout)");
    std::stop_source gone;
    std::string answer;
    std::jthread client(
        [&] { answer = refusal([&] { (void)decoding.decode(large_png(), {gone.get_token()}); }); });
    const pid_t busy = halted_decoder_of(::getpid());
    ASSERT_NE(busy, 0);
    const auto begin = Clock::now();
    gone.request_stop();
    client.join();
    EXPECT_LT(Clock::now() - begin, 300ms);
    EXPECT_TRUE(answer.starts_with("cancelled: ")) << answer;
    EXPECT_TRUE(comes_true([&] { return !is_alive(busy); }, 1s));
    EXPECT_EQ(count(DecodeResult::abandoned), 2u);
    EXPECT_EQ(decoding.check(small_png(), {}).width, 16);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // which need terabytes
TEST_F(Pool, MemoryIsLimitedByName) {
    DecodePool& decoding = pool({.memory_bytes = 128u << 20});
    const std::string words =
        "too-costly: decoding the image takes more memory than the limit of 134217728 bytes "
        "(max-decode-memory)";
    EXPECT_EQ(refusal([&] { (void)decoding.check(large_png(), {}); }), words);
    EXPECT_EQ(refusal([&] { (void)decoding.decode(large_png(), {}); }), words);
    EXPECT_EQ(decoding.check(small_png(), {}).width, 16);
}
#endif

TEST_F(Pool, ProcessesCanOpenNothingAndGainNothing) {
    DecodePool& decoding = pool();
    (void)decoding.check(small_png(), {});
    const auto processes = decoding_processes_of(::getpid());
    // A process that is only just forked is not confined yet, and has been given nothing.
    EXPECT_TRUE(comes_true([] {
        const auto workers = decoding_processes_of(::getpid()).workers;
        return workers.size() == 2 &&
               std::all_of(workers.begin(), workers.end(), [](const ProcessFacts& worker) {
                   return status_of(worker.pid, "Seccomp") == "2" &&
                          status_of(worker.pid, "NoNewPrivs") == "1" &&
                          open_descriptors(worker.pid) == 4;  // standard files and its socket
               });
    }));
    EXPECT_TRUE(comes_true([&] { return open_descriptors(processes.helpers.at(0).pid) == 5; }))
        << "... and news of its children";
}

TEST_F(Pool, ManyAtOnceAreRightAndLeaveNothingBehind) {
    DecodePool& decoding = pool({.workers = 3});
    std::vector<DecodedImage> expected;
    for (int i = 0; i < 8; ++i) expected.push_back(decode(small_png(i, 100, 80)));
    (void)decoding.check(small_png(), {});
    const int before = open_descriptors(::getpid());
    std::atomic<int> wrong{0}, most{0};
    std::vector<std::thread> clients;
    clients.reserve(16);
    for (int client = 0; client < 16; ++client)
        clients.emplace_back([&, client] {
            for (int i = 0; i < 40; ++i) {
                const int seed = (client + i) % 8;
                if (!same(decoding.decode(small_png(seed, 100, 80), {}), expected[seed])) ++wrong;
                if (i % 10 == 0)
                    wrong += refusal([&] {
                                 (void)decoding.check(small_png().substr(0, 90), {});
                             }).starts_with("image-broken")
                                 ? 0
                                 : 1;
                const int now = int(decoding_processes_of(::getpid()).workers.size());
                most = std::max(most.load(), now);
            }
        });
    for (std::thread& client : clients) client.join();
    EXPECT_EQ(wrong, 0);
    EXPECT_LE(most, 3 * 2) << "as many as there are workers, and as many on their way out";
    EXPECT_TRUE(comes_true([] {
        const auto workers = decoding_processes_of(::getpid()).workers;
        return workers.size() == 3 && std::none_of(workers.begin(), workers.end(),
                                                   [](const auto& w) { return w.state == 'Z'; });
    }));
    EXPECT_EQ(open_descriptors(::getpid()), before);
}

TEST_F(Pool, TakesItsProcessesAlong) {
    (void)pool({.workers = 4}).check(small_png(), {});
    const auto [helpers, workers] = decoding_processes_of(::getpid());
    ASSERT_EQ(helpers.size(), 1u);
    end_pool();
    EXPECT_TRUE(children_of(::getpid()).empty()) << "no zombie either";
    for (const ProcessFacts& worker : workers) EXPECT_FALSE(is_alive(worker.pid));
}

}  // namespace
}  // namespace relit::server

// Images that hurt their decoder, sent to the real program: they cost a process and one refusal, and
// nothing else.
#include <gtest/gtest.h>

#include <csignal>
#include <thread>

#include "core/base/sanitized.h"
#include "tests/support/http_client.h"
#include "tests/support/processes.h"
#include "tests/support/relit_process.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// A bomb within the limits: some 200 kB that are 256 MB of floats.
const std::string& bomb() {
    static const std::string bytes = encoded(Image(8000, 8000, 1, 0.25f));
    return bytes;
}

HttpReply upload(const RelitProcess& relitd, const std::string& bytes) {
    return http(relitd.port(), "POST", "/v1/images", bytes);
}

TEST(DecodingEndToEnd, AnUploadWhoseDecoderIsKilledIsRefusedAndTheServerGoesOn) {
    RelitProcess relitd;
    HttpReply reply;
    std::thread client([&] { reply = upload(relitd, bomb()); });
    const pid_t busy = halted_decoder_of(relitd.pid());
    ASSERT_NE(busy, 0);
    ::kill(busy, SIGKILL);
    client.join();
    EXPECT_EQ(reply.status, 422) << reply.body;
    EXPECT_NE(reply.body.find("/problems/image-broken"), std::string::npos) << reply.body;
    EXPECT_EQ(upload(relitd, small_png()).status, 201);
    EXPECT_EQ(http(relitd.port(), "GET", "/healthz").status, 200);
    const auto metrics = http(relitd.port(), "GET", "/metrics").body;
    EXPECT_NE(metrics.find("relit_decodes_total{result=\"crashed\"} 1\n"), std::string::npos);
}

TEST(DecodingEndToEnd, ABombTakesNoMemoryOfTheServer) {
    if (sanitized) GTEST_SKIP() << "the sanitizer's own memory is counted";
    RelitProcess relitd({.flags = {"--max-decode-memory=128MiB"}});
    EXPECT_EQ(upload(relitd, small_png()).status, 201);
    const long before = relitd.peak_memory_mib();
    const auto reply = upload(relitd, bomb());
    EXPECT_EQ(reply.status, 422) << reply.body;
    EXPECT_NE(reply.body.find("max-decode-memory"), std::string::npos) << reply.body;
    EXPECT_LT(relitd.peak_memory_mib(), before + 20);
    EXPECT_EQ(upload(relitd, small_png(1)).status, 201);
}

TEST(DecodingEndToEnd, ALargeUploadTakesNoMemoryOfTheServer) {
    if (sanitized) GTEST_SKIP() << "the sanitizer's own memory is counted";
    RelitProcess relitd;
    const long before = relitd.peak_memory_mib();
    const auto reply = upload(relitd, encoded(Image(5000, 5000, 1, 0.25f)));  // 95 MiB of floats
    ASSERT_EQ(reply.status, 201) << reply.body;
    EXPECT_LT(relitd.peak_memory_mib(), before + 20);
}

TEST(DecodingEndToEnd, AClientThatLeavesHasItsDecoderStopped) {
    RelitProcess relitd;
    RawConnection client(relitd.port());
    ASSERT_TRUE(client.send(http_request("POST", "/v1/images", bomb())));
    const pid_t busy = halted_decoder_of(relitd.pid());
    ASSERT_NE(busy, 0);
    client.close();
    EXPECT_TRUE(comes_true([&] { return !is_alive(busy); }, 1s));
    EXPECT_EQ(upload(relitd, small_png()).status, 201);
}

TEST(DecodingEndToEnd, TermLetsADecodeFinishAndLeavesNoProcess) {
    RelitProcess relitd;
    HttpReply reply;
    std::thread client([&] { reply = upload(relitd, bomb()); });
    const pid_t busy = halted_decoder_of(relitd.pid());
    ASSERT_NE(busy, 0);
    const auto [helpers, workers] = decoding_processes_of(relitd.pid());
    relitd.signal(SIGTERM);
    std::this_thread::sleep_for(100ms);
    ::kill(busy, SIGCONT);
    client.join();
    EXPECT_EQ(reply.status, 201) << reply.body;
    EXPECT_EQ(relitd.exit_status(), 0) << relitd.log();
    for (const auto* list : {&helpers, &workers})
        for (const ProcessFacts& process : *list) EXPECT_FALSE(is_alive(process.pid));
}

TEST(DecodingEndToEnd, Kill9OfTheServerTakesItsDecodersAlong) {
    RelitProcess relitd;
    std::thread client([&] {
        try {
            (void)upload(relitd, bomb());
        } catch (const std::runtime_error&) {  // the connection ends
        }
    });
    ASSERT_NE(halted_decoder_of(relitd.pid()), 0);
    const auto [helpers, workers] = decoding_processes_of(relitd.pid());
    relitd.signal(SIGKILL);
    client.join();
    for (const auto* list : {&helpers, &workers})
        for (const ProcessFacts& process : *list)
            EXPECT_TRUE(comes_true([&] { return !is_alive(process.pid); }, 2s));
}

// Images that come along with a render, and those that are decoded again for one.
TEST(DecodingEndToEnd, RendersDecodeInProcessesToo) {
    RelitProcess relitd;
    const auto [form, type] =
        form_of({{"scene", "", R"({"height": {"part": "map"}})"}, {"map", "map.png", bomb()}});
    HttpReply reply;
    std::thread client([&] {
        reply = http(relitd.port(), "POST", "/v1/render", form, {{"Content-Type", type}});
    });
    const pid_t busy = halted_decoder_of(relitd.pid());
    ASSERT_NE(busy, 0);
    ::kill(busy, SIGKILL);
    client.join();
    EXPECT_EQ(reply.status, 422) << reply.body;
    EXPECT_NE(reply.body.find(R"("pointer":"/height)"), std::string::npos) << reply.body;
}

TEST(DecodingEndToEnd, TheHelperIsNotForPeople) {
    RelitProcess relitd({.flags = {"decode-helper"}, .with_usual_flags = false});
    EXPECT_EQ(relitd.exit_status(), 2);
    EXPECT_NE(relitd.log().find("is for relitd itself"), std::string::npos) << relitd.log();
}

}  // namespace
}  // namespace relit::test

// Renders through the real program: the same bytes everywhere, a queue that says when it is full,
// and nothing that goes on for a client who has left.
#include <gtest/gtest.h>

#include <thread>

#include "tests/support/base64.h"
#include "tests/support/http_client.h"
#include "tests/support/relit_process.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

std::string upload(int port, const std::string& image) {
    const HttpReply reply = http(port, "POST", "/v1/images", image);
    EXPECT_EQ(reply.status, 201) << reply.body;
    return reply.body.substr(reply.body.find(':') + 2, 64);
}

std::string scene_of(const std::string& id, const std::string& rest = "") {
    return R"({"height": {"image": ")" + id + "\"}" + rest + "}";
}

// A scene that takes many seconds: a count of 10000 samples for every texel.
std::string slow_scene(const std::string& id) {
    return scene_of(id, R"(, "material": {"illumination": "count", "steps": 10000})");
}

std::string large_map() { return small_png(1, 512, 512); }

HttpReply render(int port, const std::string& scene) {
    return http(port, "POST", "/v1/render", scene);
}

TEST(RenderEndToEnd, SameSceneIsTheSameBytesInAnotherRunOnAnyThreadsAndInstructions) {
    const std::string map = small_png(3, 200, 150);
    std::string bytes, etag;
    const std::vector<std::string> runs[] = {
        {"--threads=1"}, {"--threads=2"}, {"--threads=7", "--simd=portable"}};
    for (const std::vector<std::string>& flags : runs) {
        RelitProcess relitd({.flags = flags});
        const std::string id = upload(relitd.port(), map);
        const HttpReply reply =
            render(relitd.port(), scene_of(id, R"(, "output": {"width": 333})"));
        ASSERT_EQ(reply.status, 200) << reply.body;
        if (!bytes.empty()) {
            EXPECT_EQ(reply.body, bytes) << flags.back();
            EXPECT_EQ(reply.header("etag"), etag);
        }
        bytes = reply.body;
        etag = reply.header("etag");
    }
}

TEST(RenderEndToEnd, GetIsConditionalAndHeadHasNoBody) {
    RelitProcess relitd;
    const std::string id = upload(relitd.port(), small_png());
    const std::string target = "/v1/render?scene=" + encode_base64url(scene_of(id));
    const HttpReply reply = http(relitd.port(), "GET", target);
    ASSERT_EQ(reply.status, 200) << reply.body;
    const std::string etag = reply.header("etag");
    const HttpReply again =
        http(relitd.port(), "GET", target, {}, {{"If-None-Match", "\"x\", W/" + etag}});
    EXPECT_EQ(again.status, 304);
    EXPECT_EQ(again.body, "");
    EXPECT_EQ(again.header("etag"), etag);
    RawConnection connection(relitd.port());
    connection.send(http_request("HEAD", target));
    const HttpReply head = connection.receive(/*to_head=*/true);
    EXPECT_EQ(head.status, 200);
    EXPECT_EQ(head.header("content-length"), std::to_string(reply.body.size()));
    EXPECT_EQ(head.header("etag"), etag);
}

TEST(RenderEndToEnd, FullQueueIsSaidAtOnceAndHealthStillAnswers) {
    RelitProcess relitd({.flags = {"--max-renders=1", "--max-queue=1", "--threads=1"}});
    const std::string id = upload(relitd.port(), large_map());
    RawConnection running(relitd.port()), waiting(relitd.port());
    const std::string request = http_request("POST", "/v1/render", slow_scene(id));
    running.send(request);
    std::this_thread::sleep_for(100ms);  // it takes the slot
    waiting.send(request);
    std::this_thread::sleep_for(100ms);  // it takes the only place in the line
    const auto start = Clock::now();
    const HttpReply refused = render(relitd.port(), scene_of(id));
    EXPECT_EQ(refused.status, 503);
    EXPECT_NE(refused.body.find("max-queue"), std::string::npos) << refused.body;
    EXPECT_NE(refused.header("retry-after"), "");
    EXPECT_EQ(http(relitd.port(), "GET", "/healthz").status, 200);
    EXPECT_LT(Clock::now() - start, 1s);
}

TEST(RenderEndToEnd, ClientsThatLeaveMakeRoomAtOnce) {
    RelitProcess relitd({.flags = {"--max-renders=1", "--max-queue=20", "--threads=1"}});
    const std::string id = upload(relitd.port(), large_map());
    {
        std::vector<std::unique_ptr<RawConnection>> leaving;
        for (int k = 0; k < 10; ++k) {
            leaving.push_back(std::make_unique<RawConnection>(relitd.port()));
            leaving.back()->send(http_request("POST", "/v1/render", slow_scene(id)));
        }
        std::this_thread::sleep_for(200ms);
    }
    const auto start = Clock::now();
    EXPECT_EQ(render(relitd.port(), scene_of(id, R"(, "output": {"width": 16})")).status, 200);
    EXPECT_LT(Clock::now() - start, 3s) << "the slow renders went on";
}

TEST(RenderEndToEnd, ThatTakesTooLongIsA504ThatNamesTheSetting) {
    RelitProcess relitd({.flags = {"--render-timeout=1", "--threads=1"}});
    const std::string id = upload(relitd.port(), large_map());
    const auto start = Clock::now();
    const HttpReply reply = render(relitd.port(), slow_scene(id));
    EXPECT_EQ(reply.status, 504);
    EXPECT_NE(reply.body.find("render-timeout"), std::string::npos) << reply.body;
    EXPECT_LT(Clock::now() - start, 5s);
}

TEST(RenderEndToEnd, DeadlineCutsARowShort) {
    RelitProcess relitd({.flags = {"--render-timeout=1", "--threads=1"}});
    const std::string id = upload(relitd.port(), small_png(1, 2000, 1));
    const std::string sky = upload(relitd.port(), small_png(2, 20, 10));
    const auto start = Clock::now();
    const HttpReply reply = render(
        relitd.port(),
        scene_of(id, R"(, "light": {"type": "environment", "radius": 1, "image": {"image": ")" +
                         sky + R"("}}, "material": {"illumination": "count", "steps": 10000})"));
    EXPECT_EQ(reply.status, 504);
    EXPECT_LT(Clock::now() - start, 3s);
}

TEST(RenderEndToEnd, TermLetsARenderUnderWayFinish) {
    RelitProcess relitd({.flags = {"--threads=1"}});
    const std::string id = upload(relitd.port(), large_map());
    RawConnection running(relitd.port());
    running.send(
        http_request("POST", "/v1/render",
                     scene_of(id, R"(, "material": {"illumination": "count", "steps": 500})")));
    std::this_thread::sleep_for(50ms);
    relitd.signal(SIGTERM);
    const HttpReply reply = running.receive();
    EXPECT_EQ(reply.status, 200) << reply.body;
    EXPECT_EQ(reply.body.substr(1, 3), "PNG");
    EXPECT_EQ(relitd.exit_status(), 0);
}

TEST(RenderEndToEnd, UnknownImageIsA404ThatNamesTheField) {
    RelitProcess relitd;
    const HttpReply reply = render(relitd.port(), scene_of(std::string(64, '0')));
    EXPECT_EQ(reply.status, 404);
    EXPECT_NE(reply.body.find(R"("pointer":"/height/image")"), std::string::npos) << reply.body;
    EXPECT_EQ(reply.header("content-type"), "application/problem+json");
}

}  // namespace
}  // namespace relit::test

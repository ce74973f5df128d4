// The log of the real program, as whoever runs it has it.
#include <gtest/gtest.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <sstream>

#include "server/samples/samples.h"
#include "tests/support/http_client.h"
#include "tests/support/metrics_text.h"
#include "tests/support/relit_process.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

const std::string caller = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";

// Every line of a server that has ended.
std::vector<json> log_of(RelitProcess& relitd) {
    relitd.signal(SIGTERM);
    EXPECT_EQ(relitd.exit_status(), 0);
    std::vector<json> all;
    std::istringstream log(relitd.log());
    for (std::string line; std::getline(log, line);) all.push_back(json::parse(line));
    return all;
}

json line_with(const std::vector<json>& log, const std::string& id) {
    for (const json& line : log)
        if (line.value("id", "") == id) return line;
    ADD_FAILURE() << "no line of " << id;
    return json::object();
}

std::string picture() {
    return "/v1/images/" + std::string(server::samples().front().id) + "/relit.png?output.width=32";
}

TEST(LogEndToEnd, TellsOfARequestWhatItsReplyTellsToo) {
    RelitProcess relitd({.flags = {"--log-format=json", "--max-queue=7"}});
    const int port = relitd.port();
    const HttpReply ours = http(port, "GET", picture());
    const HttpReply theirs =
        http(port, "GET", picture(), "", {{"X-Request-Id", "mine-1"}, {"traceparent", caller}});
    const HttpReply refused = http(port, "POST", "/v1/render", "{}", {{"X-Request-Id", "mine-2"}});
    EXPECT_EQ(theirs.header("x-request-id"), "mine-1");
    EXPECT_EQ(theirs.header("traceresponse").substr(0, 36), caller.substr(0, 36));
    EXPECT_EQ(refused.header("x-request-id"), "mine-2");
    const auto log = log_of(relitd);
    EXPECT_EQ(log.front()["message"], "settings");
    EXPECT_EQ(log.front()["settings"]["max-queue"], "7");
    EXPECT_EQ(line_with(log, ours.header("x-request-id"))["status"], 200);
    const json line = line_with(log, "mine-1");
    EXPECT_EQ(line["bytes"], theirs.body.size());
    EXPECT_EQ(line["client"], "127.0.0.1");
    EXPECT_EQ(line["trace"], caller.substr(3, 32));
    EXPECT_EQ(line["parent_span"], caller.substr(36, 16));
    EXPECT_EQ(line["span"], theirs.header("traceresponse").substr(36, 16));
    for (const char* stage : {"parse", "queue", "decode", "render", "encode", "send"})
        EXPECT_GE(line["spans_ms"].value(stage, -1.0), 0.0) << stage;
    EXPECT_EQ(line_with(log, "mine-2")["error"], "missing-field");
}

TEST(LogEndToEnd, IsJsonLineByLineWhateverIsSent) {
    RelitProcess relitd({.flags = {"--log-format=json", "--log-level=debug"}});
    const int port = relitd.port();
    std::string bytes;
    for (int byte = 1; byte < 256; ++byte)
        if (byte != '\n' && byte != '\r') bytes += char(byte);
    const std::string hostile[] = {"GET /%22%7d%0a%1b HTTP/1.1\r\nHost: a\r\n\r\n",
                                   "GET /\"}{\\u0000%C2%9B HTTP/1.1\r\nHost: a\r\n\r\n",
                                   "G\"E\"T / HTTP/1.1\r\nHost: a\r\n\r\n",
                                   "GET /" + bytes + " HTTP/1.1\r\nHost: a\r\n\r\n",
                                   "GET /\xff\xfe HTTP/1.1\r\nHost: a\r\nX-Request-Id: \"}\r\n\r\n",
                                   bytes + "\r\n\r\n"};
    for (const std::string& request : hostile) {
        RawConnection connection(port);
        connection.send(request);
        EXPECT_GE(connection.receive().status, 400);
    }
    const auto log = log_of(relitd);
    const auto requests = std::count_if(log.begin(), log.end(), [](const json& line) {
        return line["message"] == "request" && line["status"] >= 400;
    });
    EXPECT_EQ(requests, std::ssize(hostile));
}

TEST(LogEndToEnd, TellsOfThoseWhoLeftAndOfTheSlow) {
    RelitProcess relitd({.flags = {"--log-format=json", "--log-slow=20"}});
    const int port = relitd.port();
    {
        RawConnection connection(port);
        connection.send(
            http_request("GET", picture() + "&material.illumination=count&material.steps=10000", "",
                         {{"X-Request-Id", "left"}}));
        std::this_thread::sleep_for(100ms);
    }
    (void)http(port, "GET", "/healthz", "", {{"X-Request-Id", "fast"}});
    const auto log = log_of(relitd);
    const json left = line_with(log, "left");
    EXPECT_EQ(left["message"], "slow request");
    EXPECT_EQ(left["level"], "warning");
    EXPECT_EQ(left["error"], "cancelled");
    EXPECT_EQ(left["disconnected"], true);
    EXPECT_EQ(line_with(log, "fast")["status"], 200);
}

TEST(LogEndToEnd, TellsOfRefusedConnectionsWithoutALineForEach) {
    RelitProcess relitd({.flags = {"--log-format=json", "--max-address-connections=1"}});
    RawConnection open(relitd.port());
    open.send("GET /v1/presets HTTP/1.1\r\nHost: a\r\n\r\n");
    EXPECT_EQ(open.receive().status, 200);
    std::vector<std::string> ids;
    for (int i = 0; i < 5; ++i) {
        const HttpReply refused = http(relitd.port(), "GET", "/v1/presets");
        EXPECT_EQ(refused.status, 429);
        ids.push_back(refused.header("x-request-id"));
    }
    const auto log = log_of(relitd);
    const json line = line_with(log, ids.front());
    EXPECT_EQ(line["message"], "connections refused");
    EXPECT_EQ(line["reason"], "max-address-connections");
    EXPECT_EQ(line["count"], 1);
    for (const json& other : log)
        EXPECT_TRUE(other == line || other["message"] != "connections refused") << other;
    EXPECT_NE(ids[0], ids[1]);
}

TEST(LimitsEndToEnd, BelowTheSamplesRefuseThemAndNotTheStart) {
    RelitProcess relitd({.flags = {"--max-image-pixels=1000", "--log-format=json"}});
    ASSERT_NE(relitd.port(), 0) << relitd.log();
    const HttpReply refused = http(relitd.port(), "GET", picture());
    EXPECT_EQ(refused.status, 413);
    EXPECT_NE(refused.body.find("max-image-pixels"), std::string::npos) << refused.body;
    EXPECT_EQ(http(relitd.port(), "POST", "/v1/images", small_png(1, 20, 20)).status, 201);
    EXPECT_NE(relitd.log().find("larger than --max-image-pixels allows"), std::string::npos);
}

TEST(LimitsEndToEnd, AreCountedByTheirSettings) {
    RelitProcess relitd(
        {.flags = {"--max-image-bytes=10000", "--max-image-pixels=300000", "--max-uri-bytes=300",
                   "--max-headers=10", "--max-lights=1", "--max-scene-cost=1000",
                   "--max-output-pixels=100000", "--max-json-depth=8", "--max-parts=1",
                   "--max-part-head-bytes=100", "--max-body-bytes=5000", "--max-batch-frames=1"}});
    const int port = relitd.port();
    const std::string image = server::samples().front().id;
    const std::string height = R"("height": {"image": ")" + image + "\"}";
    const auto render = [&](const std::string& more) {
        return http(port, "POST", "/v1/render", "{" + height + more + "}");
    };
    const auto form = [&](const std::string& part_head) {
        const std::string part =
            "--x\r\nContent-Disposition: form-data; name=\"scene\"" + part_head + "\r\n\r\n{}\r\n";
        return http(port, "POST", "/v1/render", part + part + "--x--\r\n",
                    {{"Content-Type", "multipart/form-data; boundary=x"}});
    };
    HttpHeaders many;
    for (int i = 0; i < 10; ++i) many.emplace_back("X-" + std::to_string(i), "1");
    const std::pair<std::string, HttpReply> refusals[] = {
        {"max-image-bytes", http(port, "POST", "/v1/images", std::string(10'001, 'x'))},
        {"max-image-pixels", http(port, "POST", "/v1/images", lying_png(600, 600, false))},
        {"max-uri-bytes", http(port, "GET", "/" + std::string(300, 'a'))},
        {"max-headers", http(port, "GET", "/healthz", "", many)},
        {"max-lights", render(R"(, "lights": [{"type": "point"}, {"type": "point"}])")},
        {"max-scene-cost", render(R"(, "output": {"width": 9})")},
        {"max-output-pixels", render(R"(, "output": {"width": 2000})")},
        {"max-json-depth", render(R"(, "light": [[[[[[[[1]]]]]]]])")},
        {"max-parts", form("")},
        {"max-part-head-bytes", form("\r\nX: " + std::string(100, 'x'))},
        {"max-body-bytes", render(std::string(5000, ' '))},
        {"max-batch-frames", http(port, "POST", "/v1/batches",
                                  R"({"scene": {)" + height + R"(}, "frames": [{}, {}]})")}};
    for (const auto& [limit, reply] : refusals) {
        EXPECT_GE(reply.status, 400) << limit;
        EXPECT_NE(reply.body.find(limit), std::string::npos) << limit << ": " << reply.body;
        EXPECT_EQ(metric_of(port, "relit_limit_refusals_total{limit=\"" + limit + "\"}"), 1)
            << limit;
    }
}

}  // namespace
}  // namespace relit::test

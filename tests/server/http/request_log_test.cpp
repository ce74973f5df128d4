#include "server/http/request_log.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "server/error_codes.h"
#include "server/logging/log.h"
#include "tests/support/temporary_folder.h"

namespace relit::server {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

// The log in a file, and what was there before afterwards.
class RequestLog : public testing::Test {
protected:
    ~RequestLog() override {
        spdlog::set_default_logger(before_);
        if (file_ >= 0) ::close(file_);
    }

    void begin(LogFormat format, spdlog::level::level_enum level = spdlog::level::info) {
        file_ = ::open((folder_.path() / "log").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
        start_log(format, level, file_);
    }

    std::vector<std::string> lines() {
        spdlog::default_logger()->flush();
        std::ifstream file(folder_.path() / "log");
        std::vector<std::string> all;
        for (std::string line; std::getline(file, line);) all.push_back(line);
        return all;
    }

    static Request a_request() {
        Request request;
        request.method = "GET";
        request.path = "/v1/images/ab/relit.png";
        request.target = "/v1/images/ab/relit.png?expires=9&signature=secret";
        request.query = {{"expires", "9"}, {"signature", "secret"}};
        request.headers = {{"Authorization", "Bearer secret"}};
        request.address = "127.0.0.1";
        request.id = "request-7";
        request.admission.key = "gallery";
        request.trace = {"trace", "caller", "ours", true};
        request.spans = {{"queue", 1ms}, {"render", 20ms}};
        return request;
    }

    test::TemporaryFolder folder_;
    std::shared_ptr<spdlog::logger> before_ = spdlog::default_logger();
    int file_ = -1;
};

TEST_F(RequestLog, SaysWhatWasAskedWhatCameOfItAndWhereTheTimeWent) {
    begin(LogFormat::json);
    log_request(a_request(),
                {.status = 200, .body_bytes = 1234, .received = 500us, .made = 22ms, .total = 25ms},
                0ms);
    const auto all = lines();
    ASSERT_EQ(all.size(), 1u);
    json line = json::parse(all[0]);
    line.erase("time");
    EXPECT_EQ(line, json::parse(R"({"level": "info", "message": "request", "id": "request-7",
        "method": "GET", "path": "/v1/images/ab/relit.png", "status": 200, "bytes": 1234,
        "duration_ms": 25.0, "spans_ms": {"receive": 0.5, "queue": 1.0, "render": 20.0, "send": 3.0},
        "client": "127.0.0.1", "key": "gallery", "trace": "trace", "span": "ours",
        "parent_span": "caller"})"));
}

TEST_F(RequestLog, SaysTheSameAsText) {
    begin(LogFormat::text);
    log_request(a_request(),
                {.status = 503,
                 .error_code = error_code::cancelled,
                 .disconnected = true,
                 .made = 22ms,
                 .total = 25ms},
                0ms);
    const auto all = lines();
    ASSERT_EQ(all.size(), 1u);
    EXPECT_TRUE(all[0].ends_with(
        " info request id=request-7 method=GET path=/v1/images/ab/relit.png status=503 bytes=0 "
        "duration_ms=25.00 queue=1.00 render=20.00 send=3.00 client=127.0.0.1 key=gallery "
        "error=cancelled disconnected=true trace=trace span=ours parent_span=caller"))
        << all[0];
}

TEST_F(RequestLog, WarnsOfSlowOnesAlsoWhereOthersAreNotLogged) {
    begin(LogFormat::json, spdlog::level::warn);
    log_request(a_request(), {.status = 200, .total = 99ms}, 100ms);
    log_request(a_request(), {.status = 200, .total = 100ms}, 100ms);
    log_request(a_request(), {.status = 200, .total = 1h}, 0ms);
    log_request(a_request(), {.status = 200, .streamed = true, .made = 1ms, .total = 1h}, 100ms);
    const auto all = lines();
    ASSERT_EQ(all.size(), 1u);
    const json line = json::parse(all[0]);
    EXPECT_EQ(line["level"], "warning");
    EXPECT_EQ(line["message"], "slow request");
    EXPECT_EQ(line["spans_ms"]["render"], 20.0);
}

TEST_F(RequestLog, NoKeyNoSignatureAndNoQueryIsInIt) {
    for (const auto format : {LogFormat::text, LogFormat::json}) {
        begin(format, spdlog::level::debug);
        log_request(a_request(), {.status = 200}, 0ms);
    }
    for (const std::string& line : lines())
        for (const char* secret : {"secret", "expires", "?"})
            EXPECT_EQ(line.find(secret), std::string::npos) << line;
}

TEST_F(RequestLog, ALineIsAnObjectWhateverThePath) {
    begin(LogFormat::json);
    std::vector<std::string> paths = {"/\n\"}{", "/\x1b[31m", "/\xff\xc3",
                                      std::string(50'000, '\\')};
    std::string all_bytes;
    for (int byte = 0; byte < 256; ++byte) all_bytes += char(byte);
    paths.push_back(all_bytes);
    for (const std::string& path : paths) {
        Request request = a_request();
        request.path = request.method = path;
        log_request(request, {.status = 404}, 0ms);
        spdlog::error("text of others: {}", path);
    }
    const auto all = lines();
    ASSERT_EQ(all.size(), 2 * paths.size());
    for (std::size_t i = 0; i < all.size(); i += 2) {
        EXPECT_EQ(json::parse(all[i])["status"], 404);
        EXPECT_LT(json::parse(all[i])["path"].get<std::string>().size(), 1000u);
        EXPECT_EQ(json::parse(all[i + 1])["level"], "error");
    }
}

TEST(RequestId, IsTheClientsWhereThatIsSaneAndElseOneOfOurs) {
    for (const std::string id : {"a", "0b4f-11", "Root=1-5759e988:x/y+z@h~._"})
        EXPECT_EQ(request_id_of({{"x-request-id", id}}), id);
    EXPECT_EQ(request_id_of({{"X-Request-Id", std::string(128, 'a')}}), std::string(128, 'a'));
    for (const std::string& bad :
         {std::string(), std::string(129, 'a'), std::string("a b"), std::string("a, b"),
          std::string("\"a\""), std::string("\xc3\xa4"), std::string("a\tb"),
          std::string("<script>")}) {
        const std::string id = request_id_of({{"X-Request-Id", bad}});
        EXPECT_NE(id, bad);
        EXPECT_EQ(request_id_of({{"X-Request-Id", id}}), id) << "ours are sane";
    }
    EXPECT_NE(request_id_of({}), request_id_of({}));
}

}  // namespace
}  // namespace relit::server

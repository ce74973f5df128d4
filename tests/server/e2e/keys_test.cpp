// Keys against the real program: who is let in, what a refusal costs, what the log knows.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include "server/access/signed_url.h"
#include "server/routes/routes.h"
#include "tests/support/http_client.h"
#include "tests/support/relit_process.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

using namespace std::chrono_literals;

const std::string reader = "reader-0123456789", renderer = "renderer-0123456789",
                  admin = "admin-0123456789-";
const std::string plato = "c19f4389c237ad9b4f5e8e7ab97c7e4770f41eee5cedf994967fa8e5eca91908";
const std::string picture = "/v1/images/" + plato + "/relit.jpg?sun=300,40&output.width=32";

HttpHeaders with(const std::string& key) { return {{"Authorization", "Bearer " + key}}; }

std::string signed_for(std::chrono::seconds valid, const std::string& target) {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    return server::signed_target(renderer, target,
                                 std::chrono::floor<std::chrono::seconds>(now + valid).count());
}

class Keys : public testing::Test {
protected:
    Keys() {
        std::ofstream(file) << reader << " read\n"
                            << renderer << " render gallery\n"
                            << admin << " admin\n";
        std::filesystem::permissions(file, std::filesystem::perms(0600));
    }
    RelitProcess& start(std::vector<std::string> flags = {}) {
        flags.push_back("--api-keys=" + file.string());
        relitd = std::make_unique<RelitProcess>(RelitProcess::Settings{.flags = flags});
        return *relitd;
    }
    TemporaryFolder folder;
    std::filesystem::path file = folder.path() / "keys";
    std::unique_ptr<RelitProcess> relitd;
};

TEST_F(Keys, EveryRouteThatIsNotOpenTakesOne) {
    const int port = start().port();
    int guarded = 0;
    for (const server::Route& route : server::routes({})) {
        const std::string what = std::string(route.method) + " " + std::string(route.pattern);
        const auto status = [&](const HttpHeaders& headers) {
            return http(port, std::string(route.method), std::string(route.pattern), "", headers)
                .status;
        };
        if (route.pattern.find('{') != std::string_view::npos && route.pattern.find("/studio/") == 0)
            continue;
        if (route.scope == server::Scope::open) {
            EXPECT_EQ(status({}), 200) << what;
            continue;
        }
        EXPECT_EQ(status({}), 401) << what;
        EXPECT_EQ(status(with("wrong-key-0123456789")), 401) << what;
        EXPECT_NE(status(with(admin)), 401) << what;
        EXPECT_NE(status(with(admin)), 403) << what;
        if (route.scope > server::Scope::read) {
            EXPECT_EQ(status(with(reader)), 403) << what;
        }
        if (route.scope > server::Scope::render) {
            EXPECT_EQ(status(with(renderer)), 403) << what;
        }
        ++guarded;
    }
    EXPECT_GT(guarded, 20);
    EXPECT_EQ(http(port, "OPTIONS", "/v1/render").status, 204) << "a preflight brings no key";
}

TEST_F(Keys, ARefusedUploadIsNotRead) {
    const int port = start().port();
    RawConnection connection(port);
    connection.send("POST /v1/images HTTP/1.1\r\nHost: a\r\nContent-Length: 200000000\r\n\r\n");
    const HttpReply reply = connection.receive();
    EXPECT_EQ(reply.status, 401);
    EXPECT_EQ(reply.header("www-authenticate"), "Bearer realm=\"relit\"");
    EXPECT_EQ(reply.header("connection"), "close");
    EXPECT_NE(reply.body.find("/problems/unauthorized"), std::string::npos) << reply.body;
    EXPECT_EQ(http(port, "POST", "/v1/images", small_png(3), with(renderer)).status, 201);
}

TEST_F(Keys, ADeniedRequestWithoutABodyKeepsItsConnection) {
    RawConnection connection(start().port());
    connection.send(http_request("GET", "/v1/images") +
                    http_request("GET", "/v1/images", "", with(reader)));
    EXPECT_EQ(connection.receive().status, 401);
    EXPECT_EQ(connection.receive().status, 200);
}

TEST_F(Keys, ASignedUrlShowsItsPictureUntilItExpires) {
    const int port = start().port();
    const std::string url = signed_for(60s, picture);
    const HttpReply shown = http(port, "GET", url);
    ASSERT_EQ(shown.status, 200) << shown.body;
    EXPECT_EQ(shown.header("cross-origin-resource-policy"), "cross-origin") << "for <img> anywhere";
    const std::string caching = shown.header("cache-control");
    EXPECT_TRUE(caching == "public, max-age=60" || caching == "public, max-age=59") << caching;
    const HttpReply by_key = http(port, "GET", picture, "", with(renderer));
    EXPECT_EQ(by_key.body, shown.body);
    EXPECT_EQ(by_key.header("etag"), shown.header("etag")) << "the ETag knows nothing of keys";
    EXPECT_TRUE(by_key.header("cache-control").starts_with("private"));
    EXPECT_EQ(http(port, "GET", url, "", {{"If-None-Match", shown.header("etag")}}).status, 304);
    RawConnection head(port);
    head.send(http_request("HEAD", url));
    EXPECT_EQ(head.receive(/*to_head=*/true).status, 200);
    EXPECT_EQ(http(port, "GET", signed_for(-1s, picture)).status, 403);
    EXPECT_EQ(http(port, "GET", url + "&relief=0.3").status, 403);
    EXPECT_EQ(http(port, "GET", picture).status, 401);
}

TEST_F(Keys, AreChangedWhileItRuns) {
    const int port = start().port();
    const std::string next = "next-key-0123456789";
    EXPECT_EQ(http(port, "GET", "/v1/images", "", with(next)).status, 401);
    std::ofstream(file, std::ios::app) << next << " read\n";
    std::this_thread::sleep_for(1100ms);
    EXPECT_EQ(http(port, "GET", "/v1/images", "", with(next)).status, 200);
    EXPECT_EQ(http(port, "GET", "/v1/images", "", with(reader)).status, 200);
}

TEST_F(Keys, AreNeverLogged) {
    const int port = start({"--log-level=debug"}).port();
    const std::string wrong = "wrong-key-0123456789";
    for (const std::string& key : {reader, renderer, admin, wrong})
        (void)http(port, "GET", "/v1/images", "", with(key));
    const std::string url = signed_for(60s, picture);
    EXPECT_EQ(http(port, "GET", url).status, 200);
    relitd->signal(SIGTERM);
    EXPECT_EQ(relitd->exit_status(), 0);
    const std::string log = relitd->log();
    for (const std::string& secret :
         {reader, renderer, admin, wrong, url.substr(url.rfind('=') + 1)})
        EXPECT_EQ(log.find(secret), std::string::npos) << secret;
    EXPECT_NE(log.find("key=gallery"), std::string::npos);
}

TEST_F(Keys, RatesAreTold) {
    const int port = start({"--rate-limit=1", "--rate-burst=3"}).port();
    for (const char* left : {"2", "1", "0"}) {
        const HttpReply reply = http(port, "GET", "/v1/presets", "", with(reader));
        EXPECT_EQ(reply.status, 200);
        EXPECT_EQ(reply.header("ratelimit-remaining"), left);
        EXPECT_EQ(reply.header("ratelimit-limit"), "3");
    }
    const HttpReply refused = http(port, "GET", "/v1/presets", "", with(reader));
    EXPECT_EQ(refused.status, 429);
    EXPECT_EQ(refused.header("retry-after"), "1");
    EXPECT_NE(refused.body.find("/problems/rate-limited"), std::string::npos);
    EXPECT_EQ(http(port, "GET", "/v1/presets", "", with(renderer)).status, 200);
    for (int i = 0; i < 20; ++i) EXPECT_EQ(http(port, "GET", "/healthz").status, 200);
}

TEST_F(Keys, AServerThatOthersReachDoesNotStartWithoutThem) {
    auto started = [&, count = 0](std::vector<std::string> flags) mutable {
        const auto data = folder.path() / std::to_string(++count);
        flags.insert(flags.end(), {"--host=0.0.0.0", "--port=0", "--data-dir=" + data.string()});
        return std::make_unique<RelitProcess>(
            RelitProcess::Settings{.flags = flags, .with_usual_flags = false});
    };
    const auto open = started({});
    EXPECT_EQ(open->exit_status(), 1);
    EXPECT_NE(open->log().find("--api-keys"), std::string::npos) << open->log();
    const auto insecure = started({"--insecure"});
    EXPECT_EQ(http(insecure->port(), "GET", "/v1/images").status, 200);
    EXPECT_NE(insecure->log().find("INSECURE"), std::string::npos);
    const auto with_keys = started({"--api-keys=" + file.string()});
    EXPECT_EQ(http(with_keys->port(), "GET", "/v1/images").status, 401);
    std::filesystem::permissions(file, std::filesystem::perms(0644));
    const auto readable = started({"--api-keys=" + file.string()});
    EXPECT_EQ(readable->exit_status(), 1);
    EXPECT_NE(readable->log().find("chmod 600"), std::string::npos);
}

// Browsers are told to be careful with whatever comes.
TEST_F(Keys, EveryReplyKeepsBrowsersCareful) {
    const int port = start().port();
    for (const std::string target : {"/", "/healthz", "/v1/images", "/nothing", "/docs"}) {
        const HttpReply reply = http(port, "GET", target);
        EXPECT_EQ(reply.header("x-content-type-options"), "nosniff") << target;
        EXPECT_EQ(reply.header("referrer-policy"), "no-referrer") << target;
        EXPECT_NE(reply.header("content-security-policy").find("frame-ancestors 'none'"),
                  std::string::npos)
            << target;
        EXPECT_EQ(reply.header("cross-origin-resource-policy"), "cross-origin") << target;
    }
    const HttpReply unchanged =
        http(port, "GET", "/", "", {{"If-None-Match", http(port, "GET", "/").header("etag")}});
    EXPECT_EQ(unchanged.status, 304);
    EXPECT_EQ(unchanged.header("content-security-policy"), "")
        << "a cache would put it in the place of the page's own";
}

}  // namespace
}  // namespace relit::test

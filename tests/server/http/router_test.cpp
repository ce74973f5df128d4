#include "server/http/router.h"

#include <gtest/gtest.h>

#include <new>
#include <numeric>
#include <set>
#include <stdexcept>

#include "server/error_codes.h"
#include "server/http/request_log.h"
#include "tests/support/test_server.h"

namespace relit::server {
namespace {

Reply say_id(const Request& request, Services&) {
    const auto id = request.path_params.find("id");
    return {.body = id == request.path_params.end() ? "none" : id->second};
}
Reply say_fixed(const Request&, Services&) { return {.body = "fixed"}; }
Reply fail_as_asked(const Request& request, Services&) {
    const auto how = request.query_value("how");
    if (how == "error") throw Error(error_code::invalid_value, "not 11", "/relief");
    if (how == "limit") throw Error(error_code::invalid_value, "too many", "", "max-lights");
    if (how == "memory") throw std::bad_alloc();
    if (how == "int") throw 42;
    throw std::runtime_error("secret of /etc");
}

Router test_router() {
    return Router({{"GET", "/v1/images/{id}", say_id},
                   {"GET", "/v1/images/{id}/content", say_id},
                   {"DELETE", "/v1/images/{id}", say_id},
                   {"POST", "/v1/images", say_id},
                   {"GET", "/v1/images/latest", say_fixed},
                   {"GET", "/fail", fail_as_asked}});
}

class Dispatch : public testing::Test {
protected:
    Reply ask(const std::string& method, const std::string& path, const std::string& how = "") {
        Request request;
        request.method = method;
        request.path = path;
        request.id = request_id_of({});
        if (!how.empty()) request.query.emplace("how", how);
        return dispatch(router_, request, services_.services);
    }
    Router router_ = test_router();
    test::TestServices services_;
};

TEST_F(Dispatch, CallsTheHandlerOfTheRouteWithItsParameters) {
    EXPECT_EQ(ask("GET", "/v1/images/abc").body, "abc");
    EXPECT_EQ(ask("GET", "/v1/images/abc/content").body, "abc");
    EXPECT_EQ(ask("GET", "/v1/images/latest").body, "fixed") << "a literal goes before a parameter";
    EXPECT_EQ(ask("DELETE", "/v1/images/latest").body, "latest");
    EXPECT_EQ(ask("POST", "/v1/images").body, "none");
}

TEST_F(Dispatch, PathsThatNoPatternFitsAre404) {
    for (const std::string path :
         {"", "/", "/v1", "/v1/images/", "/v1/images//content", "/v1/images/a/b", "/v1/images/abc/",
          "/v1//images", "/V1/images"})
        EXPECT_EQ(ask("GET", path).status, 404) << path;
    EXPECT_EQ(ask("GET", "/" + std::string(1 << 20, '/')).status, 404);
    EXPECT_EQ(ask("GET", "/" + std::string(1 << 20, 'a')).status, 404);
}

TEST_F(Dispatch, OtherMethodsAre405WithAllow) {
    const Reply reply = ask("PUT", "/v1/images/abc");
    EXPECT_EQ(reply.status, 405);
    EXPECT_EQ(reply.headers.find("Allow")->second, "DELETE, GET, HEAD, OPTIONS");
    EXPECT_EQ(ask("GET", "/v1/images").headers.find("Allow")->second, "OPTIONS, POST");
    EXPECT_EQ(ask("GET", "/nothing").headers.count("Allow"), 0u);
}

TEST_F(Dispatch, OptionsSayWhatIsAllowed) {
    const Reply reply = ask("OPTIONS", "/v1/images/abc/content");
    EXPECT_EQ(reply.status, 204);
    EXPECT_EQ(reply.headers.find("Allow")->second, "GET, HEAD, OPTIONS");
    EXPECT_EQ(ask("OPTIONS", "*").headers.find("Allow")->second,
              "DELETE, GET, HEAD, OPTIONS, POST");
    EXPECT_EQ(ask("OPTIONS", "/nothing").status, 404);
}

TEST_F(Dispatch, ErrorsBecomeTheirProblems) {
    const Reply reply = ask("GET", "/fail", "error");
    EXPECT_EQ(reply.status, 422);
    EXPECT_NE(reply.body.find("\"pointer\":\"/relief\""), std::string::npos);
}

TEST_F(Dispatch, OtherExceptionsTellTheClientNothing) {
    for (const char* how : {"runtime", "int"}) {
        const Reply reply = ask("GET", "/fail", how);
        EXPECT_EQ(reply.status, 500) << how;
        EXPECT_EQ(reply.body.find("secret"), std::string::npos);
    }
    EXPECT_EQ(ask("GET", "/fail", "memory").status, 503);
}

TEST_F(Dispatch, EveryReplyMayBeReadByOtherOrigins) {
    for (const char* path : {"/v1/images/a", "/nothing", "/fail"})
        for (const char* method : {"GET", "OPTIONS", "PUT"}) {
            const Reply reply = ask(method, path);
            EXPECT_EQ(reply.headers.at("Vary"), "Origin") << method << " " << path;
            EXPECT_EQ(reply.headers.at("Access-Control-Allow-Origin"), "*");
        }
    Request refused;
    refused.path = "/v1/images";
    const Reply reply =
        refuse(router_, refused, {error_code::body_too_large, "too large"}, services_.services);
    EXPECT_EQ(reply.headers.at("Access-Control-Allow-Origin"), "*");
}

TEST_F(Dispatch, PreflightsAreAnsweredWithTheMethodsOfThePath) {
    Request request;
    request.method = "OPTIONS";
    request.path = "/v1/images/abc";
    request.headers = {{"Origin", "https://a.org"}, {"Access-Control-Request-Method", "DELETE"}};
    const Reply reply = dispatch(router_, request, services_.services);
    EXPECT_EQ(reply.status, 204);
    EXPECT_EQ(reply.headers.at("Access-Control-Allow-Methods"), "DELETE, GET, HEAD, OPTIONS");
    EXPECT_EQ(reply.headers.at("Access-Control-Max-Age"), "7200");
}

// Whatever clients send, the labels are ours.
TEST_F(Dispatch, CountsByPatternMethodAndStatus) {
    const auto count = [&](std::string_view route, std::string_view method, int status) {
        return services_.metrics.requests.of({route, method, status}).load();
    };
    for (int i = 0; i < 100; ++i) {
        ask("GET", "/v1/images/" + std::to_string(i));
        ask("GET", "/nothing/" + std::to_string(i));
        ask("METHOD" + std::to_string(i), "/fail");
    }
    ask("GET", "/fail", "error");
    ask("GET", "/fail", "limit");
    EXPECT_EQ(services_.metrics.limit_refusals.of("max-lights"), 1u);
    EXPECT_EQ(count("/v1/images/{id}", "GET", 200), 100u);
    EXPECT_EQ(count("none", "GET", 404), 100u);
    EXPECT_EQ(count("/fail", "other", 405), 100u);
    EXPECT_EQ(count("/fail", "GET", 422), 2u);
    int members = 0;
    services_.metrics.requests.each([&](const auto&, const auto&) { ++members; });
    EXPECT_EQ(members, 4);
    EXPECT_EQ(services_.metrics.errors.of(error_code::not_found), 100u);
    EXPECT_EQ(services_.metrics.errors.of(error_code::invalid_value), 2u);
    const auto times = services_.metrics.request_times.of("/fail").counts();
    EXPECT_EQ(std::accumulate(times.begin(), times.end(), std::uint64_t(0)), 102u);
}

TEST_F(Dispatch, EveryReplyCarriesAnIdOfItsOwn) {
    std::set<std::string> ids;
    for (const char* path : {"/v1/images/a", "/nothing", "/fail"})
        ids.insert(ask("GET", path).headers.find("X-Request-Id")->second);
    EXPECT_EQ(ids.size(), 3u);
}

}  // namespace
}  // namespace relit::server

#include "server/access/access.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "server/access/signed_url.h"
#include "server/error_codes.h"
#include "server/routes/routes.h"
#include "server/storage/sha256.h"
#include "tests/support/test_server.h"

namespace relit::server {
namespace {

using namespace std::chrono_literals;

const std::string reader = "reader-0123456789", renderer = "renderer-0123456789",
                  admin = "admin-0123456789-";

// With three keys, and time that stands still until it is moved.
class WithKeys : public testing::Test {
protected:
    WithKeys() {
        const auto file = folder.path() / "keys";
        std::ofstream(file) << reader << " read\n"
                            << renderer << " render gallery\n"
                            << admin << " admin\n";
        std::filesystem::permissions(file, std::filesystem::perms(0600));
        settings.api_keys = file;
        settings.now = [this] { return now; };
        settings.rate_now = [this] { return rate_now; };
    }

    static Request request_of(const std::string& target, const std::string& key = "") {
        Request request;
        request.method = "GET";
        request.target = target;
        request.address = "192.0.2.7";
        const auto question = std::min(target.find('?'), target.size());
        request.path = target.substr(0, question);
        std::string_view query =
            std::string_view(target).substr(std::min(question + 1, target.size()));
        while (!query.empty()) {
            const auto pair = query.substr(0, query.find('&'));
            query.remove_prefix(std::min(pair.size() + 1, query.size()));
            const auto equals = pair.find('=');
            request.query.emplace(pair.substr(0, equals), pair.substr(equals + 1));
        }
        if (!key.empty()) request.headers.emplace("Authorization", "Bearer " + key);
        return request;
    }

    // The code of the refusal, or "admitted".
    static std::string outcome(Access& access, Scope needed, Request& request) {
        try {
            access.admit(needed, request);
            return "admitted";
        } catch (const Error& error) {
            return std::string(error.code);
        }
    }
    static std::string outcome(Access& access, Scope needed, Request&& request) {
        return outcome(access, needed, request);
    }
    [[nodiscard]] std::string signed_url(const std::string& key, const std::string& target,
                                         std::chrono::seconds valid = 60s) const {
        const auto expires = std::chrono::floor<std::chrono::seconds>(now + valid);
        return signed_target(key, target, expires.time_since_epoch().count());
    }

    test::TemporaryFolder folder;
    std::chrono::system_clock::time_point now{1'800'000'000s};
    RateLimit::Clock::time_point rate_now{1000s};
    AccessSettings settings;
};

TEST_F(WithKeys, EachScopeIncludesThoseBeforeIt) {
    Access access(settings);
    const std::string keys[] = {"", reader, renderer, admin};
    const Scope scopes[] = {Scope::open, Scope::read, Scope::render, Scope::admin};
    for (int key = 0; key < 4; ++key)
        for (int scope = 0; scope < 4; ++scope) {
            const std::string expected = scope == 0    ? "admitted"
                                         : key == 0    ? "unauthorized"
                                         : key < scope ? "forbidden"
                                                       : "admitted";
            EXPECT_EQ(outcome(access, scopes[scope], request_of("/v1/x", keys[key])), expected)
                << key << " " << scope;
        }
}

TEST_F(WithKeys, OnlyAWholeBearerTokenIsAKey) {
    Access access(settings);
    const auto with = [&](const std::string& header) {
        Request request = request_of("/v1/x");
        request.headers.emplace("Authorization", header);
        return outcome(access, Scope::read, request);
    };
    for (const std::string& header : {"Bearer " + reader, "bearer " + reader, "BEARER  " + reader})
        EXPECT_EQ(with(header), "admitted") << header;
    for (const std::string& header :
         std::vector<std::string>{reader, "Bearer", "Bearer ", "Basic " + reader, "Bearer" + reader,
                                  "Bearer " + reader + "0", "Bearer " + reader.substr(1),
                                  "Bearer " + reader + ", " + admin})
        EXPECT_EQ(with(header), "unauthorized") << header;
}

TEST_F(WithKeys, NamesTheKeyAndNotItsSecret) {
    Access access(settings);
    Request request = request_of("/v1/x", renderer);
    EXPECT_EQ(outcome(access, Scope::render, request), "admitted");
    EXPECT_EQ(request.admission.key, "gallery");
}

TEST_F(WithKeys, ASignedUrlIsGoodUntilItExpiresAndItsParametersAreTakenOff) {
    Access access(settings);
    const std::string url = signed_url(renderer, "/v1/images/a/relit.png?sun=300,40", 60s);
    Request request = request_of(url);
    EXPECT_EQ(outcome(access, Scope::render, request), "admitted");
    EXPECT_EQ(request.query.size(), 1u);
    EXPECT_EQ(request.query_value("sun"), "300,40");
    EXPECT_EQ(request.admission.signed_for_s, 60);
    now += 59s;
    EXPECT_EQ(outcome(access, Scope::render, request_of(url)), "admitted");
    now += 1s;
    EXPECT_EQ(outcome(access, Scope::render, request_of(url)), "signature-refused");
    EXPECT_EQ(outcome(access, Scope::read, request_of(signed_url(reader, "/v1/images"))),
              "admitted")
        << "a URL without a query of its own";
}

TEST_F(WithKeys, ASignatureGivesNoMoreThanItsKeyAndOnlyForGet) {
    Access access(settings);
    EXPECT_EQ(outcome(access, Scope::render, request_of(signed_url(reader, "/v1/x"))), "forbidden");
    Request post = request_of(signed_url(admin, "/v1/x"));
    post.method = "DELETE";
    EXPECT_EQ(outcome(access, Scope::admin, post), "signature-refused");
    EXPECT_EQ(outcome(access, Scope::read, request_of(signed_url("unknown-0123456789", "/v1/x"))),
              "signature-refused");
}

TEST_F(WithKeys, NothingOfASignedUrlMayBeChanged) {
    Access access(settings);
    const std::string url = signed_url(renderer, "/v1/images/a/relit.png?sun=300,40");
    ASSERT_EQ(outcome(access, Scope::render, request_of(url)), "admitted");
    for (std::size_t i = 0; i < url.size(); ++i) {
        std::string changed = url;
        changed[i] = changed[i] == '0' ? '1' : '0';
        EXPECT_NE(outcome(access, Scope::render, request_of(changed)), "admitted") << changed;
    }
    for (const std::string& changed :
         {url + "&sun=1,1", url + "&signature=" + std::string(64, '0'),
          url.substr(0, url.size() - 1), url + "0", "/v1/images/b" + url.substr(12),
          "/v1/images/a/relit.png?signature=" + url.substr(url.rfind('=') + 1),
          url.substr(0, url.find("expires")) + "expires=99999999999" +
              url.substr(url.find("&signature")),
          url.substr(0, url.find('?')) + "?expires=1&" + url.substr(url.find('?') + 1)})
        EXPECT_EQ(outcome(access, Scope::render, request_of(changed)), "signature-refused")
            << changed;
}

// The text that is signed, spelt out: programs in other languages make these.
TEST(SignedUrl, IsAnHmacOfGetAndTheTarget) {
    EXPECT_EQ(hmac_sha256_hex("key", "The quick brown fox jumps over the lazy dog"),
              "f7bc83f430538424b13298e6aa6fb143ef4d59a14946175997479dbc2d1a3cd8");
    EXPECT_EQ(signed_target("a-key-0123456789", "/a?b=c", 1800000000),
              "/a?b=c&expires=1800000000&signature=" +
                  hmac_sha256_hex("a-key-0123456789", "GET\n/a?b=c&expires=1800000000"));
    EXPECT_TRUE(signed_target("a-key-0123456789", "/a", 1).starts_with("/a?expires=1&signature="));
}

TEST_F(WithKeys, KeysOfOneNameShareARateAndStrangersThatOfTheirAddress) {
    settings.rate_limit = 1;
    settings.rate_burst = 2;
    Access access(settings);
    const auto ask = [&](const std::string& key) {
        return outcome(access, Scope::read, request_of("/v1/x", key));
    };
    EXPECT_EQ(ask(renderer), "admitted");
    EXPECT_EQ(ask(renderer), "admitted");
    EXPECT_EQ(ask(renderer), "rate-limited");
    EXPECT_EQ(outcome(access, Scope::render, request_of(signed_url(renderer, "/v1/x"))),
              "rate-limited")
        << "its signed URLs count too";
    EXPECT_EQ(ask(reader), "admitted");
    EXPECT_EQ(ask("wrong-key-0123456789"), "unauthorized");
    EXPECT_EQ(ask(""), "unauthorized");
    EXPECT_EQ(ask("wrong-key-0123456789"), "rate-limited") << "guessing has a rate";
    EXPECT_EQ(ask(reader), "admitted") << "which does not touch those with a key";
    rate_now += 1s;
    EXPECT_EQ(ask(renderer), "admitted");
}

TEST(Access, WithoutKeysAddressesHaveARateAndWhatIsOpenHasNone) {
    Access access({.rate_limit = 1, .rate_burst = 1, .rate_now = [] {
                       return RateLimit::Clock::time_point(1000s);
                   }});
    Request first;
    first.address = "192.0.2.7";
    access.admit(Scope::admin, first);
    Request second = first, other = first, open = first;
    EXPECT_THROW(access.admit(Scope::read, second), Error);
    EXPECT_FALSE(second.admission.rate->allowed);
    other.address = "192.0.2.8";
    access.admit(Scope::read, other);
    open.admission = {};
    access.admit(Scope::open, open);
    EXPECT_FALSE(open.admission.rate);
}

TEST(AccessHeaders, KeepWhatTakesAKeyOutOfSharedCaches) {
    const auto cached = [](const Admission& admission, const std::string& before) {
        Request request;
        request.admission = admission;
        Reply reply;
        reply.headers.emplace("Cache-Control", before);
        add_access_headers(request, reply);
        return reply.headers.find("Cache-Control")->second;
    };
    const std::string immutable = "public, max-age=31536000, immutable";
    EXPECT_EQ(cached({}, immutable), immutable);
    EXPECT_EQ(cached({.key = "a"}, immutable), "private, max-age=31536000, immutable");
    EXPECT_EQ(cached({.key = "a", .signed_for_s = 60}, immutable), "public, max-age=60");
    EXPECT_EQ(cached({.key = "a", .signed_for_s = 60}, "no-store"), "no-store");
    EXPECT_EQ(cached({.key = "a"}, "no-cache"), "no-cache");
}

TEST(AccessHeaders, TellTheRateAndHowToAskAgain) {
    Request request;
    request.admission.rate =
        RateState{.allowed = false, .limit = 5, .remaining = 0, .reset_s = 9, .retry_after_s = 2};
    Reply reply;
    reply.error_code = error_code::rate_limited;
    add_access_headers(request, reply);
    EXPECT_EQ(reply.headers.find("RateLimit-Limit")->second, "5");
    EXPECT_EQ(reply.headers.find("RateLimit-Remaining")->second, "0");
    EXPECT_EQ(reply.headers.find("RateLimit-Reset")->second, "9");
    EXPECT_EQ(reply.headers.find("Retry-After")->second, "2");
    EXPECT_FALSE(reply.headers.contains("WWW-Authenticate"));
    reply.error_code = error_code::unauthorized;
    add_access_headers(request, reply);
    EXPECT_EQ(reply.headers.find("WWW-Authenticate")->second, "Bearer realm=\"relit\"");
}

// What is open, and what takes something away, is said here once more: a row that changes by mistake
// is noticed.
TEST(Routes, OpenIsHealthPagesAndTheDescriptionAndNothingElse) {
    std::set<std::string> open, admins;
    for (const Route& route : routes({})) {
        if (route.scope == Scope::open) open.emplace(route.pattern);
        if (route.scope == Scope::admin)
            admins.insert(std::string(route.method) + " " + std::string(route.pattern));
        if (route.method != "GET") {
            EXPECT_GE(route.scope, Scope::render) << route.pattern;
        }
    }
    EXPECT_EQ(open,
              (std::set<std::string>{"/", "/docs", "/studio/{file}", "/relit.js", "/relit-jobs.js",
                                     "/v1/version", "/openapi.json", "/healthz", "/readyz"}));
    EXPECT_EQ(admins, (std::set<std::string>{"DELETE /v1/images/{id}", "GET /metrics"}));
}

}  // namespace
}  // namespace relit::server

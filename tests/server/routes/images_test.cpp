#include "server/routes/images.h"

#include <gtest/gtest.h>

#include <regex>

#include "server/http/router.h"
#include "server/routes/meta.h"
#include "server/routes/routes.h"
#include "server/schema/image_json.h"
#include "tests/support/test_server.h"
#include "tests/support/upload_images.h"

namespace relit::server {
namespace {

class ImageRoutes : public testing::Test {
protected:
    Reply ask(const std::string& method, const std::string& path, std::string body = "",
              Headers headers = {}) {
        Request request;
        request.method = method;
        request.path = path;
        request.body = std::move(body);
        request.headers = std::move(headers);
        return dispatch(router_, request, services_.services);
    }
    Reply upload(std::vector<Part> parts) {
        Request request;
        request.method = "POST";
        request.path = "/v1/images";
        request.headers = {{"Content-Type", "multipart/form-data; boundary=x"}};
        request.parts = std::move(parts);
        return dispatch(router_, request, services_.services);
    }
    Reply list(std::multimap<std::string, std::string> query) {
        Request request;
        request.method = "GET";
        request.path = "/v1/images";
        request.query = std::move(query);
        return dispatch(router_, request, services_.services);
    }
    std::string upload_one(int seed) {
        const std::string png = test::small_png(seed);
        EXPECT_EQ(ask("POST", "/v1/images", png).status, 201);
        return ImageStore::id_of(png);
    }
    test::TestServices services_;
    Router router_{routes(services_.limits)};
    const std::string png_ = test::small_png();
    const std::string id_ = ImageStore::id_of(png_);
};

TEST_F(ImageRoutes, UploadIsAnsweredByIdAndFacts) {
    const Reply created = ask("POST", "/v1/images", png_);
    EXPECT_EQ(created.status, 201);
    EXPECT_EQ(created.headers.find("Location")->second, "/v1/images/" + id_);
    const std::regex form(R"(\{"id":")" + id_ +
                          R"(","width":16,"height":12,"channels":1,"type":"uint16",)" +
                          R"("format":"png","bytes":)" + std::to_string(png_.size()) +
                          R"(,"created":"20\d\d-\d\d-\d\dT\d\d:\d\d:\d\d\.\d\d\dZ"\})");
    EXPECT_TRUE(std::regex_match(created.body, form)) << created.body;
    const Reply again = ask("POST", "/v1/images", png_);
    EXPECT_EQ(again.status, 200);
    EXPECT_EQ(again.body, created.body);
    EXPECT_EQ(ask("GET", "/v1/images/" + id_).body, created.body);
}

TEST_F(ImageRoutes, FirstFileOfAFormIsTheUpload) {
    const Reply reply = upload({{"note", "", "", "not a file"},
                                {"a", "a.png", "image/png", png_},
                                {"b", "b.png", "", "x"}});
    EXPECT_EQ(reply.status, 201);
    EXPECT_EQ(reply.headers.find("Location")->second, "/v1/images/" + id_);
    EXPECT_EQ(upload({{"note", "", "", "not a file"}}).status, 400);
    EXPECT_EQ(upload({}).status, 400);
}

TEST_F(ImageRoutes, WhatIsNoImageIsRefusedAndNotStored) {
    EXPECT_EQ(ask("POST", "/v1/images").status, 400);
    EXPECT_EQ(ask("POST", "/v1/images", "hello").status, 415);
    EXPECT_EQ(ask("POST", "/v1/images", png_.substr(0, png_.size() / 2)).status, 422);
    EXPECT_EQ(ask("POST", "/v1/images", test::lying_png(100'000, 100'000, false)).status, 413);
    EXPECT_EQ(ask("GET", "/v1/images/" + ImageStore::id_of("hello")).status, 404);
}

TEST_F(ImageRoutes, ContentIsTheBytesAndCachedForGood) {
    ask("POST", "/v1/images", png_);
    const Reply reply = ask("GET", "/v1/images/" + id_ + "/content");
    EXPECT_EQ(reply.status, 200);
    EXPECT_EQ(reply.bytes(), png_);
    EXPECT_EQ(reply.content_type, "image/png");
    EXPECT_EQ(reply.headers.find("ETag")->second, '"' + id_ + '"');
    EXPECT_NE(reply.headers.find("Cache-Control")->second.find("immutable"), std::string::npos);

    const Reply known =
        ask("GET", "/v1/images/" + id_ + "/content", "", {{"If-None-Match", '"' + id_ + '"'}});
    EXPECT_EQ(known.status, 304);
    EXPECT_TRUE(known.bytes().empty());
    EXPECT_EQ(known.headers.find("ETag")->second, '"' + id_ + '"');
}

TEST_F(ImageRoutes, DeletedImagesAreGone) {
    ask("POST", "/v1/images", png_);
    EXPECT_EQ(ask("DELETE", "/v1/images/" + id_).status, 204);
    EXPECT_EQ(ask("DELETE", "/v1/images/" + id_).status, 404);
    EXPECT_EQ(ask("GET", "/v1/images/" + id_).status, 404);
    EXPECT_EQ(ask("GET", "/v1/images/" + id_ + "/content", "", {{"If-None-Match", "*"}}).status,
              404);
    EXPECT_NE(ask("GET", "/v1/images/" + id_)
                  .body.find("There is no image with this id: upload it (again)."),
              std::string::npos);
    EXPECT_EQ(ask("POST", "/v1/images", png_).status, 201);
}

TEST_F(ImageRoutes, CreationIsTheFilesTimeInUtc) {
    ask("POST", "/v1/images", png_);
    const auto created = services_.images.find(id_)->created;
    ASSERT_TRUE(created);
    EXPECT_LT(std::chrono::system_clock::now() - *created, std::chrono::minutes(1));
    StoredImage image{.id = "x", .created = FileTime(std::chrono::milliseconds(951782400007))};
    EXPECT_NE(image_json(image).find(R"("created":"2000-02-29T00:00:00.007Z")"), std::string::npos)
        << image_json(image);
    image.created = FileTime(std::chrono::nanoseconds(-1));
    EXPECT_NE(image_json(image).find(R"("created":"1969-12-31T23:59:59.999Z")"), std::string::npos)
        << image_json(image);
    image.created.reset();
    EXPECT_NE(image_json(image).find(R"("created":null)"), std::string::npos);
}

TEST_F(ImageRoutes, IdsThatAreNoneAreNotFound) {
    for (const std::string& id : {std::string("x"), std::string(".."), std::string(64, 'F')})
        EXPECT_EQ(ask("GET", "/v1/images/" + id).status, 404) << id;
}

// An upload that others have made costs no slot: the decoder has seen these bytes.
TEST_F(ImageRoutes, StoredBytesAreNotDecodedAgain) {
    ask("POST", "/v1/images", png_);
    const auto busy = services_.decodes.wait_for_slot(RenderSlots::Clock::time_point::max(), {});
    EXPECT_EQ(ask("POST", "/v1/images", png_).status, 200);
}

TEST_F(ImageRoutes, UploadWaitsForItsTurnToBeDecoded) {
    const auto busy = services_.decodes.wait_for_slot(RenderSlots::Clock::time_point::max(), {});
    Request request;
    request.method = "POST";
    request.path = "/v1/images";
    request.body = png_;
    request.deadline = RenderSlots::Clock::now() + std::chrono::milliseconds(20);
    EXPECT_EQ(dispatch(router_, request, services_.services).status, 504);
}

// A store of one small image and a bit.
TEST(SmallStore, EvictsForNewImagesAndSaysWhatDoesNotFit) {
    const std::string png = test::small_png();
    test::TestServices services({.max_storage_bytes = png.size() + 10});
    const Router router{routes(services.limits)};
    const auto upload = [&](std::string body) {
        Request request;
        request.method = "POST";
        request.path = "/v1/images";
        request.body = std::move(body);
        return dispatch(router, request, services.services);
    };
    EXPECT_EQ(upload(png).status, 201);
    EXPECT_EQ(upload(test::small_png(1)).status, 201);
    EXPECT_FALSE(services.images.contains(ImageStore::id_of(png)));

    const auto held = services.images.get(ImageStore::id_of(test::small_png(1)));
    for (const Reply& full : {upload(png), upload(test::small_png(0, 200, 200))}) {
        EXPECT_EQ(full.status, 507);
        EXPECT_NE(full.body.find(std::to_string(png.size() + 10)), std::string::npos) << full.body;
        EXPECT_NE(full.body.find("(max-storage)"), std::string::npos) << full.body;
    }
}

TEST_F(ImageRoutes, ListIsEmptyAtFirst) {
    const Reply reply = list({});
    EXPECT_EQ(reply.status, 200);
    EXPECT_EQ(reply.body, R"({"images":[],"next":null})");
    EXPECT_EQ(reply.headers.find("Cache-Control")->second, "no-cache");
}

TEST_F(ImageRoutes, ListIsNewestFirstAndGoesOnAfterNext) {
    std::vector<std::string> facts;
    for (int seed = 0; seed < 3; ++seed)
        facts.push_back(ask("GET", "/v1/images/" + upload_one(seed)).body);
    const Reply whole = list({});
    EXPECT_EQ(whole.body,
              R"({"images":[)" + facts[2] + "," + facts[1] + "," + facts[0] + R"(],"next":null})");
    const Reply first = list({{"limit", "2"}});
    std::smatch next;
    ASSERT_TRUE(std::regex_search(first.body, next, std::regex(R"re("next":"([^"]+)")re")));
    EXPECT_EQ(first.body, R"({"images":[)" + facts[2] + "," + facts[1] + R"(],"next":")" +
                              next[1].str() + "\"}");
    const std::string rest = R"({"images":[)" + facts[0] + R"(],"next":null})";
    EXPECT_EQ(list({{"limit", "2"}, {"after", next[1]}}).body, rest);
    const std::string second = ImageStore::id_of(test::small_png(1));
    EXPECT_EQ(list({{"after", second}}).body, rest) << "a plain id is a place too";

    services_.images.remove(second);
    EXPECT_EQ(list({{"after", next[1]}}).body, rest) << "its image is gone, the place is not";
    EXPECT_EQ(list({{"after", second}}).status, 422) << "where it stood nobody knows";
}

TEST_F(ImageRoutes, ListRefusesWhatItDoesNotUnderstandByName) {
    const std::string stored = upload_one(0);
    const std::tuple<std::multimap<std::string, std::string>, std::string, std::string> rows[] = {
        {{{"limit", "0"}}, "invalid-value", "'limit'"},
        {{{"limit", "1001"}}, "invalid-value", "'limit'"},
        {{{"limit", "-1"}}, "invalid-value", "'limit'"},
        {{{"limit", "+1"}}, "invalid-value", "'limit'"},
        {{{"limit", "1.0"}}, "invalid-value", "'limit'"},
        {{{"limit", " 1"}}, "invalid-value", "'limit'"},
        {{{"limit", "many"}}, "invalid-value", "'limit'"},
        {{{"limit", ""}}, "invalid-value", "'limit'"},
        {{{"limit", "99999999999999999999999"}}, "invalid-value", "'limit'"},
        {{{"after", ""}}, "invalid-value", "'after'"},
        {{{"after", "x"}}, "invalid-value", "'after'"},
        {{{"after", std::string(64, '0')}}, "invalid-value", "'after'"},
        {{{"after", "-" + stored}}, "invalid-value", "'after'"},
        {{{"after", "1x-" + stored}}, "invalid-value", "'after'"},
        {{{"after", "1-" + stored.substr(1)}}, "invalid-value", "'after'"},
        {{{"after", "99999999999999999999-" + stored}}, "invalid-value", "'after'"},
        {{{"before", "x"}}, "unknown-field", "'before'"},
        {{{"limit", "1"}, {"limit", "1"}}, "duplicate-field", "'limit'"},
        {{{"after", stored}, {"after", stored}}, "duplicate-field", "'after'"},
    };
    for (const auto& [query, code, name] : rows) {
        const Reply reply = list(query);
        EXPECT_EQ(reply.status, 422) << query.begin()->second;
        EXPECT_EQ(reply.error_code, code) << query.begin()->second;
        EXPECT_NE(reply.body.find(name), std::string::npos) << reply.body;
    }
    for (const char* limit : {"1", "1000"}) EXPECT_EQ(list({{"limit", limit}}).status, 200);
}

TEST(BuiltInImageRoutes, AreServedAndNotDeleted) {
    const std::string png = test::small_png();
    const std::string path = "/v1/images/" + ImageStore::id_of(png);
    test::TestServices services({}, {{ImageStore::id_of(png), png}});
    const Router router{routes(services.limits)};
    const auto ask = [&](const char* method, const std::string& target, std::string body = "") {
        Request request;
        request.method = method;
        request.path = target;
        request.body = std::move(body);
        return dispatch(router, request, services.services);
    };
    EXPECT_EQ(ask("GET", path).status, 200);
    EXPECT_NE(ask("GET", path).body.find(R"("created":null)"), std::string::npos);
    EXPECT_EQ(ask("GET", path + "/content").bytes(), png);
    EXPECT_EQ(ask("GET", path + "/content").content_type, "image/png");
    EXPECT_EQ(ask("GET", "/v1/images").body, R"({"images":[],"next":null})");
    const Reply refused = ask("DELETE", path);
    EXPECT_EQ(refused.status, 409);
    EXPECT_EQ(refused.error_code, "conflict");

    EXPECT_EQ(ask("POST", "/v1/images", png).status, 201);
    EXPECT_EQ(ask("POST", "/v1/images", png).status, 200);
    EXPECT_NE(ask("GET", "/v1/images").body.find(ImageStore::id_of(png)), std::string::npos);
    EXPECT_EQ(ask("DELETE", path).status, 204);
    EXPECT_EQ(ask("DELETE", path).status, 409);
}

TEST_F(ImageRoutes, VersionIsJson) {
    const Reply reply = ask("GET", "/v1/version");
    EXPECT_EQ(reply.body, R"({"name":"relit","version":")" + std::string(version()) + "\"}");
}

}  // namespace
}  // namespace relit::server

#include "server/routes/images.h"

#include <gtest/gtest.h>

#include "server/http/router.h"
#include "server/routes/meta.h"
#include "server/routes/routes.h"
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
        return dispatch(router_, std::move(request), services_.services);
    }
    Reply upload(std::vector<Part> parts) {
        Request request;
        request.method = "POST";
        request.path = "/v1/images";
        request.headers = {{"Content-Type", "multipart/form-data; boundary=x"}};
        request.parts = std::move(parts);
        return dispatch(router_, std::move(request), services_.services);
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
    EXPECT_EQ(created.body, R"({"id":")" + id_ +
                                R"(","width":16,"height":12,"channels":1,"type":"uint16",)" +
                                R"("format":"png","bytes":)" + std::to_string(png_.size()) + "}");
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
    EXPECT_EQ(ask("POST", "/v1/images", png_).status, 201);
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

TEST_F(ImageRoutes, VersionIsJson) {
    const Reply reply = ask("GET", "/v1/version");
    EXPECT_EQ(reply.body, R"({"name":"relit","version":")" + std::string(version()) + "\"}");
}

}  // namespace
}  // namespace relit::server

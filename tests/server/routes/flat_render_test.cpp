// GET /v1/images/{id}/relit.*, and the dry run of renders.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/io/decode.h"
#include "server/error_codes.h"
#include "server/routes/render.h"
#include "server/routes/scene.h"
#include "server/storage/sha256.h"
#include "tests/support/test_server.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

using nlohmann::json;
using server::Reply;
using server::Request;
using Query = std::multimap<std::string, std::string>;

class FlatRender : public testing::Test {
protected:
    FlatRender() : id_(services_.images.put(png_, decode(png_).info).id) {}

    Reply get(const std::string& file, const Query& query, const std::string& none_match = "") {
        Request request;
        request.method = "GET";
        request.path = "/v1/images/" + id_ + "/" + file;
        request.path_params = {{"id", id_}};
        request.query = query;
        if (!none_match.empty()) request.headers["If-None-Match"] = none_match;
        return server::render_picture(request, services_.services);
    }
    Reply post(const std::string& body, Reply (*handler)(const Request&, server::Services&)) {
        Request request;
        request.method = "POST";
        request.body = body;
        return handler(request, services_.services);
    }
    [[nodiscard]] std::string scene(const std::string& rest = "") const {
        return R"({"height": {"image": ")" + id_ + "\"}" + (rest.empty() ? "" : ", " + rest) + "}";
    }
    template <class Call>
    void expect_error(const Call& call, std::string_view code, const std::string& pointer) {
        try {
            (void)call();
            ADD_FAILURE() << "accepted";
        } catch (const Error& e) {
            EXPECT_EQ(e.code, code) << e.what();
            EXPECT_EQ(e.pointer, pointer) << e.what();
        }
    }

    const std::string png_ = small_png(3, 24, 18);
    TestServices services_;
    std::string id_;
};

TEST(SceneCostOverHttp, IsRefusedByRendersDryRunsAndFlatParameters) {
    TestServices services({.max_scene_cost = 1000});  // the map has 432 texels
    const std::string png = small_png(3, 24, 18);
    const std::string id = services.images.put(png, decode(png).info).id;
    const auto answer = [&](server::Handler handler, const std::string& rest) {
        Request request;
        request.method = "POST";
        request.body = R"({"height": {"image": ")" + id + "\"}, " + rest + "}";
        try {
            return std::to_string(handler(request, services.services).status);
        } catch (const Error& e) {
            return std::string(e.code) + " " + e.pointer;
        }
    };
    const std::string two = R"("lights": [{"type": "point"}, {"type": "point"}])";
    const std::string three =
        R"("lights": [{"type": "point"}, {"type": "point"}, {"type": "point"}])";
    for (const server::Handler handler : {server::render_picture, server::check_scene}) {
        EXPECT_EQ(answer(handler, two), "200");
        EXPECT_EQ(answer(handler, three), "too-costly /lights");
    }
}

TEST_F(FlatRender, IsThePictureOfTheSameSceneInJson) {
    const Reply flat = get("relit.webp", {{"light", "0.3,0.8,0.4"},
                                          {"light.color", "#ffeedd"},
                                          {"material.specular.k", "0.4"},
                                          {"material.specular.falloff", "0.5,1"},
                                          {"output.region", "2,2,10,8"},
                                          {"base", "auto"}});
    const Reply posted = post(scene(R"("base": "auto",
        "light": {"type": "point", "position": [0.3, 0.8, 0.4], "color": "#ffeedd"},
        "material": {"specular": {"k": 0.4, "falloff": [0.5, 1]}},
        "output": {"format": "webp", "region": [2, 2, 10, 8]})"),
                              server::render_picture);
    EXPECT_EQ(flat.content_type, "image/webp");
    EXPECT_EQ(flat.bytes(), posted.bytes());
    EXPECT_EQ(flat.headers.at("ETag"), posted.headers.at("ETag"));
    EXPECT_EQ(get("relit.webp", {{"base", "auto"}}, "\"other\"").status, 200);
    const Reply plain = get("relit.png", {});
    EXPECT_EQ(get("relit.png", {}, plain.headers.at("ETag")).status, 304);
}

TEST_F(FlatRender, TheEndingIsTheFormat) {
    EXPECT_EQ(get("relit.png", {}).content_type, "image/png");
    EXPECT_EQ(get("relit.jpg", {}).content_type, "image/jpeg");
    EXPECT_EQ(get("relit.exr", {}).content_type, "image/x-exr");
}

TEST_F(FlatRender, RefusesWhatThePathHasSaidAndWhatIsNoField) {
    using namespace error_code;
    expect_error(
        [&] {
            return get("relit.png", {{"output.format", "png"}});
        },
        invalid_value, "/output/format");
    expect_error(
        [&] {
            return get("relit.png", {{"height.image", "x"}});
        },
        invalid_value, "/height");
    expect_error([&] { return get("relit.png", {{"colour", "red"}}); }, unknown_field, "/colour");
    expect_error(
        [&] {
            return get("relit.png", {{"relief", "1"}, {"relief", "1"}});
        },
        duplicate_field, "/relief");
    expect_error([&] { return get("relit.png", {{"relief", "high"}}); }, invalid_value, "/relief");
    expect_error(
        [&] {
            return get("relit.png", {{"alpha.part", "mask"}});
        },
        invalid_value, "/alpha/part");
}

TEST_F(FlatRender, DryRunAnswersTheSceneWholeWithThePicturesEtag) {
    const std::string text = scene(R"("preset": "bronze", "output": {"width": 12})");
    const Reply dry = post(text, server::check_scene);
    const Reply picture = post(text, server::render_picture);
    EXPECT_EQ(dry.headers.at("ETag"), picture.headers.at("ETag"));
    EXPECT_EQ(dry.headers.at("Cache-Control"), "no-store");
    const json whole = json::parse(dry.bytes());
    EXPECT_EQ(whole["relief"], 0.12);
    EXPECT_EQ(whole["material"]["steps"], 100);
    EXPECT_FALSE(whole.contains("preset"));
    EXPECT_EQ(post(std::string(dry.bytes()), server::check_scene).bytes(), dry.bytes());
}

TEST_F(FlatRender, DryRunOfAPreviewHasNoEtagAsItsPictureHasNone) {
    const Reply dry = post(scene(R"("output": {"accuracy": "preview"})"), server::check_scene);
    EXPECT_EQ(dry.headers.count("ETag"), 0u);
}

TEST_F(FlatRender, DryRunRefusesWhatARenderRefuses) {
    using namespace error_code;
    const std::pair<std::string, std::pair<std::string_view, const char*>> refusals[] = {
        {R"("alpha": {"image": "none"})", {not_found, "/alpha/image"}},
        {R"("alpha": {"data": "AAAA"})", {image_not_supported, "/alpha/data"}},
        {R"("output": {"region": [20, 0, 10, 1]})", {invalid_value, "/output/region"}},
        {R"("output": {"width": 32768, "height": 32768})", {invalid_value, "/output/width"}},
    };
    for (const auto& [rest, expected] : refusals) {
        SCOPED_TRACE(rest);
        for (const auto handler : {server::check_scene, server::render_picture})
            expect_error([&, r = rest] { return post(scene(r), handler); }, expected.first,
                         expected.second);
    }
}

}  // namespace
}  // namespace relit::test

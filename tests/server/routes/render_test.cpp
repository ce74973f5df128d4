#include "server/routes/render.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/io/decode.h"
#include "server/error_codes.h"
#include "server/storage/sha256.h"
#include "tests/support/base64.h"
#include "tests/support/test_server.h"
#include "tests/support/upload_images.h"

namespace relit::test {
namespace {

using server::render_picture;
using server::Reply;
using server::Request;

class RenderRoute : public testing::Test {
protected:
    RenderRoute() : id_(services_.images.put(png_, decode(png_).info).id) {}

    [[nodiscard]] std::string scene(const std::string& rest = "") const {
        return R"({"height": {"image": ")" + id_ + "\"}" + (rest.empty() ? "" : ", " + rest) + "}";
    }
    Reply post(const std::string& json) {
        Request request;
        request.method = "POST";
        request.body = json;
        return render_picture(request, services_.services);
    }
    Reply get(const std::string& json, const std::string& if_none_match = "") {
        Request request;
        request.method = "GET";
        request.query.emplace("scene", encode_base64url(json));
        if (!if_none_match.empty()) request.headers["If-None-Match"] = if_none_match;
        return render_picture(request, services_.services);
    }
    void expect_error(const std::string& json, std::string_view code, const std::string& pointer) {
        SCOPED_TRACE(json.substr(0, 200));
        try {
            (void)post(json);
            ADD_FAILURE() << "accepted";
        } catch (const Error& e) {
            EXPECT_EQ(e.code, code) << e.what();
            EXPECT_EQ(e.pointer, pointer);
        }
    }

    const std::string png_ = small_png(0, 24, 18);
    TestServices services_;
    std::string id_;
};

TEST_F(RenderRoute, AnswersAPictureWithItsNameAndItsTimes) {
    const Reply reply = post(scene());
    EXPECT_EQ(reply.status, 200);
    EXPECT_EQ(reply.content_type, "image/png");
    const DecodedImage picture = decode(reply.bytes());
    EXPECT_EQ(picture.info.width, 24);
    EXPECT_EQ(picture.info.height, 18);
    EXPECT_EQ(picture.info.channels, 3);
    const std::string timing = reply.headers.at("Server-Timing");
    for (const char* stage : {"decode;dur=", "queue;dur=", "render;dur=", "encode;dur="})
        EXPECT_NE(timing.find(stage), std::string::npos) << timing;
    EXPECT_EQ(reply.headers.at("Relit-Accuracy"), "final");
    EXPECT_EQ(reply.headers.at("ETag").size(), 34u);
}

TEST_F(RenderRoute, KeepsTheWholeSceneInAPng) {
    const Reply reply = post(scene(R"("relief": 0.25)"));
    const std::string bytes(reply.bytes());
    EXPECT_NE(bytes.find("relit-scene"), std::string::npos);
    EXPECT_NE(bytes.find(R"("relief":0.25,"base":"none")"), std::string::npos);
}

TEST_F(RenderRoute, GetIsTheSameAsPostAndKnowsItsOwnEtag) {
    const Reply posted = post(scene());
    const Reply got = get(scene());
    EXPECT_EQ(got.bytes(), posted.bytes());
    EXPECT_EQ(got.headers.at("ETag"), posted.headers.at("ETag"));
    const Reply again = get(scene(), posted.headers.at("ETag"));
    EXPECT_EQ(again.status, 304);
    EXPECT_EQ(again.bytes(), "");
    EXPECT_EQ(get(scene(), "\"other\"").status, 200);
}

TEST_F(RenderRoute, EtagFollowsTheSceneAndNothingElse) {
    const std::string etag = post(scene()).headers.at("ETag");
    EXPECT_EQ(post(scene(R"("relief": 1.5e-1)")).headers.at("ETag"), etag);
    EXPECT_EQ(post(R"({"height": {"data": ")" + encode_base64(png_) + R"("}})").headers.at("ETag"),
              etag);
    for (const char* change :
         {R"("relief": 0.16)", R"("base": "auto")", R"("normalScale": 2)",
          R"("light": {"type": "point", "intensity": 2})", R"("material": {"depth": 0.009})",
          R"("material": {"specular": {"k": 0.1}})", R"("output": {"width": 12})",
          R"("output": {"format": "jpeg"})", R"("output": {"effort": "small"})",
          R"("output": {"exposure": 1})"})
        EXPECT_NE(post(scene(change)).headers.at("ETag"), etag) << change;
}

TEST_F(RenderRoute, WritesEveryFormatAndDepth) {
    const std::tuple<const char*, const char*, FileFormat, SampleType> cases[] = {
        {R"("output": {"format": "png"})", "image/png", FileFormat::png, SampleType::uint8},
        {R"("output": {"format": "png", "bitDepth": 16})", "image/png", FileFormat::png,
         SampleType::uint16},
        {R"("output": {"format": "jpeg"})", "image/jpeg", FileFormat::jpeg, SampleType::uint8},
        {R"("output": {"format": "webp"})", "image/webp", FileFormat::webp, SampleType::uint8},
        {R"("output": {"format": "exr"})", "image/x-exr", FileFormat::exr, SampleType::float32},
        {R"("output": {"format": "exr", "bitDepth": 16})", "image/x-exr", FileFormat::exr,
         SampleType::float16},
    };
    for (const auto& [change, media_type, format, type] : cases) {
        const Reply reply = post(scene(change));
        EXPECT_EQ(reply.content_type, media_type);
        const ImageInfo info = decode(reply.bytes()).info;
        EXPECT_EQ(info.format, format) << change;
        EXPECT_EQ(info.type, type) << change;
    }
}

TEST_F(RenderRoute, ScalarLayersHaveOneChannel) {
    for (const char* layer :
         {"illumination", "thickness", "specular", "scatter", "height", "alpha"}) {
        const Reply reply = post(scene(std::string(R"("output": {"layer": ")") + layer + "\"}"));
        EXPECT_EQ(decode(reply.bytes()).info.channels, 1) << layer;
    }
}

TEST_F(RenderRoute, PreviewsAreNotKeptByCaches) {
    const Reply reply = post(scene(R"("output": {"accuracy": "preview", "width": 12})"));
    EXPECT_EQ(reply.headers.at("Cache-Control"), "no-store");
    EXPECT_FALSE(reply.headers.contains("ETag"));
    EXPECT_EQ(reply.headers.at("Relit-Accuracy"), "preview; map=12x9");
    const Reply below = post(scene(
        R"("material": {"model": "dipole"}, "output": {"accuracy": "preview", "width": 12})"));
    EXPECT_EQ(below.headers.at("Relit-Accuracy"), "preview; map=12x9; transport=coarse");
}

TEST_F(RenderRoute, SaysFromWhichRangeHeightsWereRescaled) {
    Image metres(5, 4, 1, 100.0f);
    metres.at(2, 2) = 350.5f;
    const std::string exr = encoded(metres, {.format = PictureFormat::exr, .bit_depth = 32});
    const Reply reply = post(R"({"height": {"data": ")" + encode_base64(exr) + R"("}})");
    EXPECT_EQ(reply.headers.at("Relit-Height-Range"), "100 350.5");
    EXPECT_FALSE(post(scene()).headers.contains("Relit-Height-Range"));
}

TEST_F(RenderRoute, TakesImagesFromTheFormItCameIn) {
    Request request;
    request.method = "POST";
    request.headers["Content-Type"] = "multipart/form-data; boundary=x";
    request.parts = {{"scene", "", "application/json", R"({"height": {"part": "relief"}})"},
                     {"relief", "relief.png", "image/png", png_}};
    const Reply reply = render_picture(request, services_.services);
    EXPECT_EQ(reply.bytes(), post(scene()).bytes());
    request.parts.pop_back();
    try {
        (void)render_picture(request, services_.services);
        FAIL() << "accepted";
    } catch (const Error& e) {
        EXPECT_EQ(e.pointer, "/height/part");
    }
}

TEST_F(RenderRoute, NamesTheImageThatIsMissingOrBroken) {
    using namespace error_code;
    const std::string unknown(64, 'a');
    expect_error(R"({"height": {"image": ")" + unknown + R"("}})", not_found, "/height/image");
    expect_error(R"({"height": {"image": "../../etc/passwd"}})", not_found, "/height/image");
    expect_error(scene(R"("alpha": {"image": ")" + unknown + "\"}"), not_found, "/alpha/image");
    expect_error(
        scene(R"("lights": [{"type": "point"}, {"type": "environment", "image": {"image": "x"}}])"),
        not_found, "/lights/1/image/image");
    expect_error(scene(R"("albedo": {"data": "????"})"), invalid_value, "/albedo/data");
    expect_error(scene(R"("albedo": {"data": "AAAA"})"), image_not_supported, "/albedo/data");
    expect_error(
        scene(R"("albedo": {"data": ")" + encode_base64(lying_png(100000, 100000, false)) + "\"}"),
        image_too_large, "/albedo/data");
}

TEST_F(RenderRoute, ChecksRegionAndSizeAgainstTheMap) {
    using namespace error_code;
    expect_error(scene(R"("output": {"region": [20, 0, 5, 5]})"), invalid_value, "/output/region");
    expect_error(scene(R"("output": {"width": 30000})"), invalid_value, "/output/width");
    expect_error(scene(R"("output": {"height": 20, "width": 20000, "format": "webp"})"),
                 invalid_value, "/output/format");
    EXPECT_EQ(post(scene(R"("output": {"region": [19, 13, 5, 5]})")).status, 200);
}

TEST_F(RenderRoute, StopsAtTheDeadlineAndWhenTheClientIsGone) {
    Request request;
    request.method = "POST";
    request.body = scene(R"("output": {"width": 1000})");
    request.deadline = std::chrono::steady_clock::now();
    try {
        (void)render_picture(request, services_.services);
        FAIL() << "rendered";
    } catch (const Error& e) {
        EXPECT_EQ(e.code, error_code::timed_out);
    }
    std::stop_source gone;
    gone.request_stop();
    request.deadline = std::chrono::steady_clock::time_point::max();
    request.client_gone = gone.get_token();
    try {
        (void)render_picture(request, services_.services);
        FAIL() << "rendered";
    } catch (const Error& e) {
        EXPECT_EQ(e.code, error_code::cancelled);
    }
}

TEST_F(RenderRoute, AnyEtagMatchesOnlyAPictureThatThereIs) {
    EXPECT_EQ(get(scene(), "*").status, 304);
    EXPECT_THROW((void)get(R"({"height": {"image": "gone"}})", "*"), Error);
    EXPECT_THROW((void)get(scene(R"("output": {"region": [0, 0, 99, 99]})"), "*"), Error);
}

TEST_F(RenderRoute, RefusesFormsWithPartsThatNothingNames) {
    const server::Part scene_part{"scene", "", "", R"({"height": {"part": "a"}})"};
    const server::Part file{"a", "a.png", "", png_}, other{"b", "b.png", "", png_};
    const auto refusal = [&](std::vector<server::Part> parts) -> std::string {
        Request request;
        request.method = "POST";
        request.headers["Content-Type"] = "multipart/form-data; boundary=x";
        request.parts = std::move(parts);
        try {
            (void)render_picture(request, services_.services);
        } catch (const Error& e) {
            return std::string(e.code);
        }
        return "";
    };
    EXPECT_EQ(refusal({scene_part, file}), "");
    EXPECT_EQ(refusal({scene_part, file, other}), error_code::unknown_field);
    EXPECT_EQ(refusal({scene_part, file, file}), error_code::duplicate_field);
    EXPECT_EQ(refusal({scene_part, scene_part, file}), error_code::duplicate_field);
    EXPECT_EQ(refusal({file}), error_code::missing_field);
    EXPECT_EQ(refusal({}), error_code::missing_field);
}

TEST_F(RenderRoute, TakesHeightsAsStoredWhereTheyAreAssociatedWithAlpha) {
    Image depth(4, 4, 4, 0.2f);  // a depth pass: no colour that somebody multiplied
    for (int i = 0; i < 4; ++i) depth.at(i, 2, 3) = 0.5f;
    EncodeOptions options{.format = PictureFormat::exr, .bit_depth = 32};
    const std::string exr = encoded(depth, options);
    const Reply reply = post(R"({"height": {"data": ")" + encode_base64(exr) +
                             R"("}, "output": {"layer": "height", "format": "exr"}})");
    EXPECT_NEAR(decode(reply.bytes()).image.at(1, 2), 0.2, 1e-6);
}

TEST_F(RenderRoute, RefusesAlbedosThatAreNotFinite) {
    Image albedo(4, 4, 3, 0.5f);
    albedo.at(1, 1, 1) = std::numeric_limits<float>::infinity();
    const std::string exr = encoded(albedo, {.format = PictureFormat::exr, .bit_depth = 32});
    expect_error(scene(R"("albedo": {"data": ")" + encode_base64(exr) + "\"}"),
                 error_code::invalid_value, "/albedo/data");
}

TEST_F(RenderRoute, RefusesQueriesItDoesNotKnow) {
    {
        Request posted;
        posted.method = "POST";
        posted.body = scene();
        posted.query = {{"foo", "1"}};
        EXPECT_THROW((void)render_picture(posted, services_.services), Error);
    }
    Request request;
    request.method = "GET";
    EXPECT_THROW((void)render_picture(request, services_.services), Error);
    request.query = {{"scene", "!!"}};
    EXPECT_THROW((void)render_picture(request, services_.services), Error);
    request.query = {{"scene", encode_base64url(scene())}, {"width", "5"}};
    EXPECT_THROW((void)render_picture(request, services_.services), Error);
}

TEST_F(RenderRoute, DecodesAMapOnceForAllScenesOverIt) {
    (void)post(scene());
    (void)post(scene(R"("relief": 0.5, "light": {"type": "directional"})"));
    EXPECT_EQ(services_.cache.misses(), 3u) << "the map, and a solid for each relief";
    EXPECT_EQ(services_.cache.hits(), 1u);
    (void)post(scene(R"("albedo": {"image": ")" + id_ + R"("})"));
    (void)post(scene(R"("output": {"transfer": "none"}, "albedo": {"image": ")" + id_ + R"("})"));
    EXPECT_EQ(services_.cache.misses(), 5u) << "another field with albedo, for each transfer";
    EXPECT_EQ(services_.cache.hits(), 3u) << "the solid has no colour";
}

TEST_F(RenderRoute, AnImageThatIsForgottenIsGoneForTheCacheToo) {
    (void)post(scene());
    services_.images.remove(id_);
    expect_error(scene(), error_code::not_found, "/height/image");
}

}  // namespace
}  // namespace relit::test

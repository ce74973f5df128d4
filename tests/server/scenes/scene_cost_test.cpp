#include "server/scenes/scene_cost.h"

#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include "server/error_codes.h"
#include "server/scenes/scene_loading.h"
#include "server/schema/scene_json.h"
#include "tests/support/encoded.h"

namespace relit::server {
namespace {

SceneDescription scene(const std::string& rest) {
    return parse_scene(R"({"height": {"image": "a"})" + (rest.empty() ? "" : ", " + rest) + "}",
                       64);
}

double cost(const std::string& rest, int width = 1000, int height = 500) {
    return scene_cost(scene(rest), width, height).texel_samples;
}

std::string heaviest(const std::string& rest, int width = 1000, int height = 500) {
    return scene_cost(scene(rest), width, height).heaviest;
}

std::string repeated(const std::string& light, int count) {
    std::string list = "\"lights\": [";
    for (int i = 0; i < count; ++i) list += (i == 0 ? "" : ", ") + light;
    return list + "]";
}

const std::string point = R"({"type": "point"})";

TEST(SceneCost, IsOneForEachTexelAndLight) {
    EXPECT_EQ(cost(""), 500'000);
    EXPECT_EQ(cost("", 4000, 3000), 12e6);
    EXPECT_EQ(cost(R"("light": {"type": "directional"})"), 500'000);
    EXPECT_EQ(cost(repeated(point, 7)), 7 * 500'000);
    EXPECT_EQ(cost(R"("output": {"region": [10, 10, 100, 50]})"), 5000);
}

TEST(SceneCost, CountsTheStepsOfTheThesisModeAlone) {
    EXPECT_EQ(cost(R"("material": {"steps": 10000})"), 500'000);
    EXPECT_EQ(cost(R"("material": {"illumination": "count", "steps": 10000})"), 5000.0 * 500'000);
    EXPECT_EQ(cost(R"("material": {"illumination": "count", "steps": 1})"), 500'000);
}

TEST(SceneCost, KnowsWhichEnvironmentsHaveNoShortCut) {
    const std::string sky = R"("light": {"type": "environment", "image": {"image": "b"})";
    const double quick = cost(sky + "}");
    EXPECT_LT(quick, 20.0 * 500'000);
    EXPECT_GT(quick, 500'000);
    for (const std::string& slow :
         {sky + R"(, "radius": 3})", sky + R"(}, "base": 0)", sky + R"(}, "base": -0.001)",
          sky + R"(}, "base": -9)", sky + R"(}, "relief": 6, "material": {"depth": 0.008})",
          sky + R"(}, "material": {"specular": {"k": 0.5, "occlude": true}})"})
        EXPECT_EQ(cost(slow), 256.0 * 500'000) << slow;
    for (const std::string floor : {"\"none\"", "\"auto\"", "-0.01", "-2"})
        EXPECT_EQ(cost(sky + "}, \"base\": " + floor), quick) << floor;
    EXPECT_EQ(cost(sky + R"(}, "material": {"specular": {"k": 0, "occlude": true}})"), quick);
    EXPECT_EQ(cost(sky + R"(, "radius": 3}, "output": {"accuracy": "preview"})"), 64.0 * 500'000);
}

TEST(SceneCost, CountsLightThatIsCarriedBelowTheSurfaceOfAllOfTheMap) {
    const std::string dipole = R"("material": {"model": "dipole"})";
    EXPECT_EQ(cost(dipole), 151.0 * 500'000);
    EXPECT_EQ(heaviest(dipole), "/material/model");
    EXPECT_EQ(cost(dipole + R"(, "output": {"region": [0, 0, 10, 10]})"), 151.0 * 500'000);
    EXPECT_EQ(cost(dipole + R"(, "output": {"accuracy": "preview"})"), 11.0 * 500'000);
    EXPECT_EQ(cost(R"("material": {"model": "dipole", "highlight": {"k": 1}})"), 301.0 * 500'000);
    EXPECT_EQ(cost(R"("material": {"model": "directional-dipole"})"), 501.0 * 500'000);
}

TEST(SceneCost, FollowsTheLayer) {
    const std::string lights = repeated(point, 9) + ", ";
    EXPECT_EQ(cost(lights + R"("output": {"layer": "illumination"})"), 500'000)
        << "the first light";
    EXPECT_EQ(cost(lights + R"("output": {"layer": "normal"})"), 0);
}

TEST(SceneCost, CountsPixelsBeyondTheTexels) {
    EXPECT_EQ(cost(R"("output": {"width": 500})"), 500'000) << "fewer cost nothing more";
    EXPECT_EQ(cost(R"("output": {"width": 4000})"), 500'000 + 4000 * 2000);
    EXPECT_EQ(cost(R"("output": {"width": 500, "accuracy": "preview"})"), 500 * 250);
}

TEST(SceneCost, NamesTheFieldThatWeighsMost) {
    EXPECT_EQ(heaviest("", 20'000, 3000), "/height");
    EXPECT_EQ(heaviest(R"("output": {"region": [0, 0, 20000, 3000]})", 30'000, 3000),
              "/output/region");
    EXPECT_EQ(heaviest(repeated(point, 60)), "/lights");
    EXPECT_EQ(heaviest(R"("material": {"illumination": "count", "steps": 9000})"),
              "/material/steps");
    EXPECT_EQ(heaviest(R"("output": {"width": 8000})"), "/output/width");
    EXPECT_EQ(heaviest(R"("output": {"height": 8000})"), "/output/height");
    const std::string sky = R"({"type": "environment", "image": {"image": "b"}, "radius": 2})";
    EXPECT_EQ(heaviest("\"light\": " + sky), "/light");
    EXPECT_EQ(heaviest("\"lights\": [" + point + ", " + sky + "]"), "/lights/1");
    EXPECT_EQ(heaviest("\"lights\": [" + sky + ", " + point + ", " + sky + "]"), "/lights");
}

TEST(SceneCost, TheDefaultLimitLetsSaneScenesThroughAndAbsurdOnesNot) {
    const Limits limits;
    const std::string sky = R"({"type": "environment", "image": {"image": "b"}})";
    const std::string near = R"({"type": "environment", "image": {"image": "b"}, "radius": 2})";
    const std::tuple<std::string, int> sane[] = {
        {"", 8192},
        {repeated(point, 64), 8192},
        {"\"lights\": [" + sky + ", " + sky + "]", 8192},
        {"\"light\": " + near, 4096},
        {R"("material": {"illumination": "count"})", 8192},
        {R"("material": {"illumination": "count", "steps": 1000})", 4096},
        {R"("output": {"width": 8192})", 512},
    };
    for (const auto& [rest, side] : sane)
        EXPECT_NO_THROW(check_cost(scene(rest), side, side, limits)) << rest;
    const std::tuple<std::string, int> absurd[] = {
        {repeated(near, 64), 1024},
        {repeated(near, 10), 4096},
        {repeated(sky, 64), 8192},
        {R"("material": {"illumination": "count", "steps": 10000})", 4096},
        {repeated(point, 64) + R"(, "material": {"illumination": "count", "steps": 10000})", 512},
    };
    for (const auto& [rest, side] : absurd)
        EXPECT_THROW(check_cost(scene(rest), side, side, limits), Error) << rest;
}

// A map that is loaded is looked at where it matters.
TEST(SceneCost, NoiseCountsForEnvironments) {
    const auto code_of = [](bool is_noise, std::int64_t max_scene_cost) {
        Image map(64, 64, 1);
        std::uint32_t random = 1;
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 64; ++x)
                map.at(x, y) =
                    is_noise ? float((random = random * 1664525 + 1013904223) >> 8) / float(1 << 24)
                             : float(x) / 64.0f;
        const std::string file =
            test::encoded(map, {.format = PictureFormat::png, .bit_depth = 16, .srgb = false});
        Limits limits;
        limits.max_scene_cost = max_scene_cost;
        SharedCache cache(1 << 20);
        const Executor executor(1);
        try {
            (void)load_scene(
                scene(R"("light": {"type": "environment", "image": {"image": "b"}})"),
                [&](const ImageSource&) {
                    return SharedBytes{nullptr, file};
                },
                [](std::string_view bytes) { return decode(bytes); }, limits, executor, cache);
            return std::string("loaded");
        } catch (const Error& error) {
            EXPECT_EQ(error.pointer, "/light");
            return std::string(error.code);
        }
    };
    constexpr std::int64_t texels = 64 * 64;
    EXPECT_EQ(code_of(false, 100 * texels), "loaded");
    EXPECT_EQ(code_of(true, 100 * texels), "too-costly");
    EXPECT_EQ(code_of(true, 256 * texels), "loaded");
    EXPECT_EQ(code_of(false, 10 * texels), "too-costly") << "dear enough without";
}

TEST(SceneMemory, OfALargeMapIsAFewTimesTheMapAndOfSkiesMuchMore) {
    const auto maps = [](const std::string& rest) {
        return scene_memory(scene(rest), 16384, 16384).bytes / (4.0 * 16384 * 16384);
    };
    const auto largest = [](const std::string& rest) {
        return scene_memory(scene(rest), 16384, 16384).largest;
    };
    EXPECT_LT(maps(R"("output": {"format": "jpeg"})"), 4.5);
    EXPECT_GT(maps(R"("output": {"format": "jpeg"})"), 3);
    EXPECT_LT(maps(R"("output": {"format": "png", "width": 1024})"), 3.5);
    EXPECT_LT(maps(R"("output": {"accuracy": "preview", "width": 1024})"), 1.2);
    EXPECT_GT(maps(R"("output": {"format": "exr"})"), 10);
    const std::string sky = R"("light": {"type": "environment", "image": {"image": "b"}})";
    EXPECT_GT(maps(sky), 30);
    EXPECT_GT(maps(sky + R"(, "base": "auto")"), 60);
    EXPECT_LT(maps(sky + R"(, "output": {"region": [0, 0, 512, 512]})"), 10);
    EXPECT_EQ(largest(sky), "/light");
    EXPECT_EQ(largest(""), "/height");
    EXPECT_EQ(largest(R"("output": {"format": "exr"})"), "/output/width");
    EXPECT_EQ(largest(R"("material": {"model": "dipole", "medium": "marble"})"), "/material/model");
}

TEST(SceneMemory, BeyondItsLimitIsRefusedWithBothValues) {
    const SceneDescription of = scene(R"("output": {"format": "jpeg"})");
    const double bytes = scene_memory(of, 8000, 8000).bytes;
    try {
        check_cost(of, 8000, 8000, {.max_render_memory_bytes = 1'000'000'000});
        ADD_FAILURE() << "accepted";
    } catch (const Error& error) {
        EXPECT_EQ(error.code, error_code::too_costly);
        EXPECT_EQ(error.what(),
                  fmt::format("the picture would take about {:.0f} bytes of memory; the limit is "
                              "1000000000 (max-render-memory)",
                              bytes));
        EXPECT_EQ(error.limit, "max-render-memory");
        EXPECT_EQ(error.pointer, "/height");
    }
    EXPECT_NO_THROW(check_cost(of, 8000, 8000, {.max_render_memory_bytes = 1'200'000'000}));
    EXPECT_NO_THROW(check_cost(of, 16384, 16384, {}));
}

TEST(SceneCost, TheRefusalHasBothValues) {
    try {
        check_cost(scene(repeated(point, 3)), 1000, 500, {.max_scene_cost = 1'000'000});
        ADD_FAILURE() << "accepted";
    } catch (const Error& error) {
        EXPECT_EQ(error.code, error_code::too_costly);
        EXPECT_STREQ(error.what(),
                     "the picture would take about 1500000 texel-samples; the limit is 1000000 "
                     "(max-scene-cost)");
        EXPECT_EQ(error.pointer, "/lights");
    }
    EXPECT_NO_THROW(check_cost(scene(repeated(point, 2)), 1000, 500, {.max_scene_cost = 1'000'000}));
}

}  // namespace
}  // namespace relit::server

// GET /v1/media: every medium with its numbers, by which, or by its name, a scene takes it.
#include "server/schema/media_json.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/scatter/medium.h"
#include "server/schema/scene_json.h"

namespace relit::test {
namespace {

using Json = nlohmann::json;

Json listed_media() { return Json::parse(server::media_json())["media"]; }

std::string scene_of(const Json& medium) {
    const Json scene = {{"height", {{"image", "h"}}}, {"material", {{"medium", medium}}}};
    return server::scene_json(server::parse_scene(scene.dump(), 1));
}

TEST(MediaJson, HasEveryMeasuredMedium) {
    EXPECT_EQ(listed_media().size(), scatter::measured_media().size());
    for (const Json& medium : listed_media())
        for (const char* text : {"name", "title", "source"})
            EXPECT_FALSE(medium[text].get<std::string>().empty()) << medium;
}

TEST(MediaJson, NamesAndNumbersAreTheSameMedium) {
    for (const Json& medium : listed_media())
        EXPECT_EQ(scene_of(medium["name"]), scene_of(medium["medium"])) << medium["name"];
    EXPECT_NE(scene_of("skin1"), scene_of("skin2"));
}

TEST(MediaJson, SaysWhatFollowsFromTheNumbers) {
    for (const Json& medium : listed_media()) {
        if (medium["name"] != "marble") continue;
        EXPECT_NEAR(medium["albedo"][0].get<double>(), 0.830, 0.001);
        EXPECT_NEAR(medium["freePath"][2].get<double>(), 1 / 3.0071, 1e-6);
        EXPECT_NEAR(medium["reach"][0].get<double>(), 1 / 0.117516935, 1e-4);
        return;
    }
    ADD_FAILURE() << "no marble";
}

}  // namespace
}  // namespace relit::test

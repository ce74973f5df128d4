// Batches as they are asked for: patches, sweeps, names, and whom a refusal blames.
#include "server/schema/batch_request.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "server/error_codes.h"

namespace relit::server {
namespace {

using Json = nlohmann::json;

BatchRequest parsed(const std::string& json, int max_frames = 1000) {
    return parse_batch(json, {.max_lights = 8, .max_frames = max_frames},
                       [](const SceneDescription&) {});
}

std::vector<Json> scenes_of(const std::string& json) {
    std::vector<Json> scenes;
    for (const BatchFrame& frame : parsed(json).frames) scenes.push_back(Json::parse(frame.scene));
    return scenes;
}

const std::string height = R"("height": {"image": "m"})";

std::string sweep(const std::string& rest, const std::string& scene = "") {
    return "{\"scene\": {" + height + scene + "}, \"sweep\": {" + rest + "}}";
}

TEST(BatchRequest, FramesAreMergePatchesOverTheScene) {
    const auto scenes = scenes_of("{\"scene\": {" + height +
                                  R"(, "relief": 0.3, "material": {"depth": 0.1, "steps": 7}},
            "frames": [{}, {"relief": 0.4}, {"relief": null, "material": {"depth": null}},
                       {"material": null}, {"height": {"data": "AAAA"}}]})");
    ASSERT_EQ(scenes.size(), 5u);
    EXPECT_EQ(scenes[0]["relief"], 0.3);
    EXPECT_EQ(scenes[1]["relief"], 0.4);
    EXPECT_EQ(scenes[1]["material"]["steps"], 7);
    EXPECT_EQ(scenes[2]["relief"], 0.15) << "null is the default";
    EXPECT_EQ(scenes[2]["material"]["depth"], 0.008);
    EXPECT_EQ(scenes[2]["material"]["steps"], 7);
    EXPECT_EQ(scenes[3]["material"]["steps"], 100);
    EXPECT_EQ(scenes[4]["height"], Json({{"data", "AAAA"}})) << "an image is one value";
}

TEST(BatchRequest, NullGoesBackToTheDefaultAlsoOverAPreset) {
    const auto scenes = scenes_of("{\"scene\": {" + height + R"(, "preset": "bronze"},
        "frames": [{}, {"relief": null}, {"preset": null}, {"preset": "wax"}]})");
    EXPECT_EQ(scenes[0]["relief"], 0.12);
    EXPECT_EQ(scenes[1]["relief"], 0.15);
    EXPECT_EQ(scenes[2]["relief"], 0.15);
    EXPECT_NE(scenes[3]["material"], scenes[0]["material"]);
}

TEST(BatchRequest, ALightOfAnotherTypeReplacesTheLightWhole) {
    const auto scenes = scenes_of("{\"scene\": {" + height +
                                  R"(, "light": {"type": "point", "position": [0, 0, 1]}},
            "frames": [{"light": {"intensity": 2}}, {"light": {"type": "directional"}},
                       {"lights": [{"type": "point"}, {"type": "directional"}]}]})");
    EXPECT_EQ(scenes[0]["light"]["position"], Json({0, 0, 1}));
    EXPECT_EQ(scenes[0]["light"]["intensity"], 2);
    EXPECT_EQ(scenes[1]["light"]["type"], "directional");
    EXPECT_EQ(scenes[2]["lights"].size(), 2u);
}

TEST(BatchRequest, NamesAreTheNumberAndTheFormatUnlessGiven) {
    const auto batch = parsed("{\"scene\": {" + height + R"(}, "frames": [{}, {"name": "b.png"},
        {"output": {"format": "jpeg"}}, {"output": {"format": "exr"}}], "priority": -3})");
    EXPECT_EQ(batch.priority, -3);
    ASSERT_EQ(batch.frames.size(), 4u);
    EXPECT_EQ(batch.frames[0].name, "0000.png");
    EXPECT_EQ(batch.frames[1].name, "b.png");
    EXPECT_EQ(batch.frames[2].name, "0002.jpg");
    EXPECT_EQ(batch.frames[3].name, "0003.exr");
    EXPECT_EQ(parsed(sweep(R"("path": "orbit", "count": 10001)"), 20000).frames[0].name,
              "00000.png");
}

TEST(BatchRequest, AnOrbitIsALoopWithoutADoubledLastFrame) {
    const auto scenes = scenes_of(sweep(R"("path": "orbit", "count": 4, "elevation": 30)"));
    ASSERT_EQ(scenes.size(), 4u);
    const int azimuths[] = {315, 45, 135, 225};
    for (int i = 0; i < 4; ++i) {
        EXPECT_EQ(scenes[i]["light"]["azimuth"], azimuths[i]);
        EXPECT_EQ(scenes[i]["light"]["elevation"], 30);
    }
    const auto back = scenes_of(sweep(R"("path": "orbit", "count": 4, "azimuth": 0, "turns": -1)"));
    EXPECT_EQ(back[1]["light"]["azimuth"], 270);
}

TEST(BatchRequest, AnArcGoesFromEndToEndAndBackWhereItReturns) {
    const std::string arc = R"("path": "arc", "from": [90, 0], "to": [270, 60], "count": )";
    const auto open = scenes_of(sweep(arc + "3"));
    EXPECT_EQ(open[0]["light"]["azimuth"], 90);
    EXPECT_EQ(open[1]["light"]["elevation"], 30);
    EXPECT_EQ(open[2]["light"]["azimuth"], 270);
    const auto back = scenes_of(sweep(arc + R"(4, "returns": true)"));
    EXPECT_EQ(back[2]["light"]["azimuth"], 270);
    EXPECT_EQ(back[3]["light"], back[1]["light"]);
}

TEST(BatchRequest, ASweptLightKeepsItsColourWhateverItsTypeWas) {
    const auto scenes = scenes_of(
        sweep(R"("path": "line", "from": [0, 0, 1], "to": [1, 0, 1], "count": 3)",
              R"(, "light": {"type": "directional", "direction": [0, 0, 1], "color": "#ff0000"})"));
    EXPECT_EQ(scenes[1]["light"]["type"], "point");
    EXPECT_EQ(scenes[1]["light"]["position"], Json({0.5, 0, 1}));
    EXPECT_EQ(scenes[1]["light"]["color"], "#ff0000");
    const auto sun =
        scenes_of(sweep(R"("path": "orbit", "count": 1)",
                        R"(, "light": {"type": "directional", "direction": [0, 0, 1]})"));
    EXPECT_EQ(sun[0]["light"]["azimuth"], 315) << "the angles count, not the direction";
}

TEST(BatchRequest, AnEnvironmentTurnsFromWhereItIs) {
    const std::string sky =
        R"({"type": "environment", "image": {"image": "e"}, "rotation": [10, 5]})";
    const auto scenes =
        scenes_of(sweep(R"("path": "environment", "count": 4)", ", \"light\": " + sky));
    EXPECT_EQ(scenes[0]["light"]["rotation"], Json({10, 5}));
    EXPECT_EQ(scenes[3]["light"]["rotation"], Json({280, 5}));
    const auto second = scenes_of(sweep(R"("path": "environment", "count": 2, "light": 1)",
                                        R"(, "lights": [{"type": "point"}, )" + sky + "]"));
    EXPECT_EQ(second[1]["lights"][1]["rotation"], Json({190, 5}));
    EXPECT_EQ(second[1]["lights"][0]["type"], "point");
}

struct Refused {
    std::string json;
    std::string_view code;
    const char* pointer;
};

TEST(BatchRequest, ARefusalNamesTheFieldWhereItWasSent) {
    const std::string scene = "{\"scene\": {" + height + "}, ";
    const Refused cases[] = {
        {"[]", error_code::invalid_value, ""},
        {"{", error_code::malformed_json, ""},
        {"{}", error_code::missing_field, ""},
        {R"({"frames": [{}]})", error_code::missing_field, "/scene"},
        {scene + R"("frames": []})", error_code::invalid_value, "/frames"},
        {scene + R"("frames": [{}], "scenes": [{}]})", error_code::missing_field, ""},
        {scene + R"("scenes": [{}]})", error_code::invalid_value, "/scene"},
        {scene + R"("frames": [{}], "colour": 1})", error_code::unknown_field, "/colour"},
        {scene + R"("frames": [{}], "priority": 101})", error_code::invalid_value, "/priority"},
        {scene + R"("frames": [{}, 7]})", error_code::invalid_value, "/frames/1"},
        {scene + R"("frames": [{}, {"light": {"type": "point", "position": [1, 2]}}]})",
         error_code::invalid_value, "/frames/1/light/position"},
        {scene + R"("frames": [{"material": {"shine": null}}]})", error_code::unknown_field,
         "/frames/0/material/shine"},
        {scene + R"("frames": [{"light": {}}]})", error_code::missing_field, "/frames/0/light/type"},
        {"{\"scene\": {" + height + R"(, "relief": -1}, "frames": [{"base": "auto"}]})",
         error_code::invalid_value, "/scene/relief"},
        {R"({"scene": {}, "frames": [{}]})", error_code::missing_field, "/scene/height"},
        {R"({"scenes": [{"relief": 1}]})", error_code::missing_field, "/scenes/0/height"},
        {scene + R"("frames": [{"name": "../x"}]})", error_code::invalid_value, "/frames/0/name"},
        {scene + R"("frames": [{"name": ".x"}]})", error_code::invalid_value, "/frames/0/name"},
        {scene + R"("frames": [{"name": "-x"}]})", error_code::invalid_value, "/frames/0/name"},
        {scene + R"("frames": [{}, {"name": "a.JPG"}]})", error_code::invalid_value,
         "/frames/1/name"},
        {scene + R"("frames": [{"name": "a.png", "output": {"format": "exr"}}]})",
         error_code::invalid_value, "/frames/0/name"},
        {scene + R"("frames": [{"name": ""}]})", error_code::invalid_value, "/frames/0/name"},
        {scene + R"("frames": [{"name": "problems.json"}]})", error_code::invalid_value,
         "/frames/0/name"},
        {scene + R"("frames": [{"name": "a.png"}, {"name": "A.PNG"}]})",
         error_code::duplicate_field, ""},
        {sweep(R"("path": "orbit")"), error_code::missing_field, "/sweep/count"},
        {sweep(R"("path": "orbit", "count": 0)"), error_code::invalid_value, "/sweep/count"},
        {sweep(R"("path": "orbit", "count": 1001)"), error_code::invalid_value, "/sweep/count"},
        {sweep(R"("path": "circle", "count": 1)"), error_code::invalid_value, "/sweep/path"},
        {sweep(R"("path": "orbit", "count": 1, "turns": 0)"), error_code::invalid_value,
         "/sweep/turns"},
        {sweep(R"("path": "orbit", "count": 1, "from": [0, 0])"), error_code::unknown_field,
         "/sweep/from"},
        {sweep(R"("path": "arc", "count": 1, "from": [0, 91], "to": [0, 0])"),
         error_code::invalid_value, "/sweep/from/1"},
        {sweep(R"("path": "line", "count": 1, "from": [0, 0, 0])"), error_code::missing_field,
         "/sweep/to"},
        {sweep(R"("path": "orbit", "count": 1, "easing": "bounce")"), error_code::invalid_value,
         "/sweep/easing"},
        {sweep(R"("path": "orbit", "count": 1, "light": 1)"), error_code::invalid_value,
         "/sweep/light"},
        {sweep(R"("path": "environment", "count": 1)"), error_code::invalid_value, "/sweep/path"},
        {sweep(R"("path": "orbit", "count": 1)", R"(, "light": {"type": "directional", "hue": 1})"),
         error_code::unknown_field, "/scene/light/hue"},
        {sweep(R"("path": "orbit", "count": 1)", R"(, "light": {"type": "point", "hue": 1})"),
         error_code::unknown_field, "/scene/light/hue"},
        {sweep(R"("path": "line", "from": [0, 0, 1], "to": [1, 0, 1], "count": 1)",
               R"(, "light": "sun")"),
         error_code::invalid_value, "/scene/light"},
    };
    for (const Refused& refused : cases) try {
            (void)parsed(refused.json);
            ADD_FAILURE() << refused.json;
        } catch (const Error& error) {
            EXPECT_EQ(error.code, refused.code) << refused.json << error.what();
            EXPECT_EQ(error.pointer, refused.pointer) << refused.json << error.what();
        }
}

TEST(BatchRequest, MoreFramesThanMayBeAreRefusedWithTheLimit) {
    try {
        (void)parsed("{\"scene\": {" + height + R"(}, "frames": [{}, {}, {}]})", 2);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.pointer, "/frames");
        EXPECT_NE(std::string(error.what()).find("max-batch-frames"), std::string::npos);
    }
}

TEST(BatchRequest, WhatACheckRefusesIsBlamedOnItsFrame) {
    try {
        (void)parse_batch("{\"scene\": {" + height + R"(}, "frames": [{}, {"relief": 1}]})",
                          {8, 10}, [](const SceneDescription& scene) {
                              if (scene.relief == 1)
                                  throw Error(error_code::not_found, "gone", "/relief");
                          });
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.code, error_code::not_found);
        EXPECT_EQ(error.pointer, "/frames/1/relief");
        EXPECT_STREQ(error.what(), "frame 1: gone");
    }
}

}  // namespace
}  // namespace relit::server

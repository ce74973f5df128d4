#include "server/schema/settings.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "server/error_codes.h"
#include "server/schema/scene_json.h"

namespace relit::test {
namespace {

using nlohmann::json;
using server::Setting;
using server::with_settings;

json laid(const std::string& scene, const std::vector<Setting>& settings) {
    return json::parse(with_settings(scene, settings));
}

void expect_refused(const std::string& scene, const std::vector<Setting>& settings,
                    std::string_view code, const std::string& pointer, const std::string& says) {
    try {
        (void)with_settings(scene, settings);
        ADD_FAILURE() << "accepted";
    } catch (const Error& e) {
        EXPECT_EQ(e.code, code) << e.what();
        EXPECT_EQ(e.pointer, pointer) << e.what();
        EXPECT_NE(std::string(e.what()).find(says), std::string::npos) << e.what();
    }
}

TEST(Settings, ReadValuesAsWhatTheyLookLike) {
    const std::pair<const char*, json> values[] = {
        {"0.4", 0.4},
        {".5", 0.5},
        {"5.", 5},
        {"+2", 2},
        {"-1e-3", -1e-3},
        {"true", true},
        {"false", false},
        {"null", nullptr},
        {"auto", "auto"},
        {"#ff0000", "#ff0000"},
        {"1,2,.5", {1, 2, 0.5}},
        {"[1, 2]", {1, 2}},
        {R"({"a": 1})", {{"a", 1}}},
        {R"("12")", "12"},
        {"inf", "inf"},
        {"nan", "nan"},
        {"+-1", "+-1"},
        {"0x10", "0x10"},
        {"", ""},
    };
    for (const auto& [text, value] : values)
        EXPECT_EQ(laid("{}", {{"a.b", text}})["a"]["b"], value) << text;
}

TEST(Settings, FieldsThatAreTextStayText) {
    const std::string id(64, '1');
    EXPECT_EQ(laid("{}", {{"height.image", id}})["height"]["image"], id);
    EXPECT_EQ(laid("{}", {{"alpha.part", "null"}})["alpha"]["part"], "null");
    EXPECT_EQ(laid("{}", {{"light.type", "1"}})["light"]["type"], "1");
    EXPECT_EQ(laid("{}", {{"preset", "null"}})["preset"], nullptr);
}

TEST(Settings, LieOverTheSceneAndLeaveTheRest) {
    const json scene = laid(R"({"relief": 0.1, "material": {"depth": 1, "specular": {"k": 0.2}}})",
                            {{"material.specular.k", "0.4"}, {"base", "auto"}});
    EXPECT_EQ(scene, json::parse(R"({"relief": 0.1, "base": "auto",
                                     "material": {"depth": 1, "specular": {"k": 0.4}}})"));
}

TEST(Settings, ReachIntoListsInAnyOrder) {
    const json scene = laid("{}", {{"lights.10.a", "10"},
                                   {"lights.2.a", "2"},
                                   {"lights.0.a", "0"},
                                   {"lights.1.a", "1"},
                                   {"lights.3.a", "3"},
                                   {"lights.9.a", "9"},
                                   {"lights.4.a", "4"},
                                   {"lights.5.a", "5"},
                                   {"lights.6.a", "6"},
                                   {"lights.7.a", "7"},
                                   {"lights.8.a", "8"}});
    ASSERT_EQ(scene["lights"].size(), 11u);
    for (int i = 0; i <= 10; ++i) EXPECT_EQ(scene["lights"][i]["a"], i);
    EXPECT_EQ(laid(R"({"a": [1, 2]})", {{"a.1", "7"}}), json::parse(R"({"a": [1, 7]})"));
    expect_refused("{}", {{"lights.1.a", "1"}}, error_code::invalid_value, "/lights/1", "skips");
}

TEST(Settings, ShortLightsAreLights) {
    EXPECT_EQ(laid("{}", {{"light", "0.3,0.8,.4"}})["light"],
              json::parse(R"({"type": "point", "position": [0.3, 0.8, 0.4]})"));
    EXPECT_EQ(laid("{}", {{"sun", "300,18"}})["light"],
              json::parse(R"({"type": "directional", "azimuth": 300, "elevation": 18})"));
    EXPECT_EQ(laid("{}", {{"env", "abc"}})["light"],
              json::parse(R"({"type": "environment", "image": {"image": "abc"}})"));
    EXPECT_EQ(laid("{}", {{"env", "abc,30"}})["light"]["rotation"], json({30, 0}));
    EXPECT_EQ(laid("{}", {{"env", "abc,30,-5"}})["light"]["rotation"], json({30, -5}));
}

TEST(Settings, ShortLightsKeepTheRestOfOneOfTheirTypeAndReplaceOthers) {
    const std::string point = R"({"light": {"type": "point", "color": "#ff0000"}})";
    EXPECT_EQ(laid(point, {{"light", "0,0,1"}, {"light.intensity", "2"}})["light"],
              json::parse(R"({"type": "point", "color": "#ff0000", "position": [0, 0, 1],
                              "intensity": 2})"));
    EXPECT_FALSE(laid(point, {{"sun", "0,45"}})["light"].contains("color"));
    const json several = laid(R"({"lights": [{"type": "point"}]})", {{"light", "0,0,1"}});
    EXPECT_FALSE(several.contains("lights"));
    EXPECT_FALSE(laid(R"({"light": {"type": "directional", "direction": [0, 0, 1]}})",
                      {{"sun", "0,45"}})["light"]
                     .contains("direction"));
}

TEST(Settings, OverAPresetMoveItsLight) {
    const auto scene = server::parse_scene(
        with_settings(R"({"height": {"image": "h"}, "preset": "bronze"})", {{"light", "1,0,0.5"}}),
        1);
    const auto& light = std::get<PointLight>(scene.lights.at(0));
    EXPECT_EQ(light.position, (Vec3{1, 0, 0.5}));
    EXPECT_EQ(light.intensity, 1.7);
}

TEST(Settings, RefuseWhatCannotBe) {
    using namespace error_code;
    expect_refused("{}", {{"relief", "1"}, {"relief", "1"}}, duplicate_field, "/relief", "twice");
    expect_refused("{}", {{"material", R"({"depth": 1})"}, {"material.depth", "2"}},
                   duplicate_field, "/material/depth", "'material' has it too");
    expect_refused("{}", {{"light", R"({"type": "point"})"}, {"light.intensity", "3"}},
                   duplicate_field, "/light/intensity", "twice");
    expect_refused("{}", {{"lights.0.a", "1"}, {"lights.00.b", "1"}}, invalid_value, "/lights/00",
                   "below a field");
    expect_refused("{}", {{"light", "0,0,1"}, {"sun", "0,45"}}, invalid_value, "/sun",
                   "exclude each other");
    expect_refused("{}", {{"sun", "0"}}, invalid_value, "/sun", "2 numbers");
    expect_refused("{}", {{"sun", "north,45"}}, invalid_value, "/sun", "numbers");
    expect_refused("{}", {{"env", "a,1,2,3"}}, invalid_value, "/env", "yaw,pitch");
    expect_refused(R"({"relief": 1})", {{"relief.deep", "1"}}, invalid_value, "/relief/deep",
                   "below a field");
    expect_refused("{}", {{"a", "[1, 2"}}, malformed_json, "/a", "'a'");
    expect_refused("[]", {}, invalid_value, "", "object");
    std::string deep = "a";
    for (int i = 0; i < 10000; ++i) deep += ".a";
    expect_refused("{}", {{deep, "1"}}, unknown_field, "", "segments");
}

}  // namespace
}  // namespace relit::test

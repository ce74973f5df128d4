// Every field of a scene, held against the contract's numbers written out once more: its default,
// both ends of its range, one past each, wrong types, an unknown sibling.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>

#include "server/error_codes.h"
#include "server/schema/field_paths.h"
#include "server/schema/openapi.h"
#include "server/schema/scene_json.h"
#include "tests/server/schema/field_rows.h"
#include "tests/support/json_schema.h"

namespace relit::test {
namespace {

using Json = nlohmann::json;
using Pointer = Json::json_pointer;

Json scene_of(const Row& row) {
    Json scene = {{"height", {{"image", "h"}}}};
    scene.merge_patch(Json::parse(row.within));
    return scene;
}

Json with_value(const Row& row, const char* value) {
    Json scene = scene_of(row);
    scene[Pointer(row.pointer)] = Json::parse(value);
    return scene;
}

Json written(const Json& scene) {
    return Json::parse(server::scene_json(server::parse_scene(scene.dump(), 64)));
}

void expect_refused(const Json& scene, std::string_view code, const std::string& pointer,
                    const std::string& says) {
    SCOPED_TRACE(scene.dump());
    try {
        (void)server::parse_scene(scene.dump(), 64);
        ADD_FAILURE() << "accepted";
    } catch (const Error& e) {
        EXPECT_EQ(e.code, code);
        EXPECT_TRUE(e.pointer == pointer || e.pointer.starts_with(pointer + "/"))
            << e.pointer << " and not " << pointer;
        EXPECT_NE(std::string(e.what()).find(says), std::string::npos) << e.what();
    }
}

// A value as the scene's one form has it: numbers as numbers, colours in lower case.
bool is_same_value(const Json& written_value, const Json& value) {
    if (value.is_string() && value.get<std::string>().starts_with('#')) {
        std::string text = value.get<std::string>();
        for (char& c : text) c = char(std::tolower(c));
        return written_value == text;
    }
    return written_value == value;
}

TEST(FieldTable, EveryDefaultIsTheContracts) {
    for (const Row& row : rows) {
        if (std::string_view(row.default_value).empty()) continue;
        EXPECT_EQ(written(scene_of(row)).at(Pointer(row.pointer)).dump(),
                  Json::parse(row.default_value).dump())
            << row.pointer << " within " << row.within;
    }
}

TEST(FieldTable, EveryRangeHoldsItsEnds) {
    for (const Row& row : rows)
        for (const char* value : row.good) {
            SCOPED_TRACE(testing::Message() << row.pointer << " = " << value);
            Json scene;
            ASSERT_NO_THROW(scene = written(with_value(row, value)));
            // Objects are written whole, with every default; the rows of their fields look at them.
            const Json expected = Json::parse(value);
            const bool is_list_of_numbers = expected.is_array() && expected[0].is_number();
            if (expected.is_structured() && !is_list_of_numbers) continue;
            EXPECT_TRUE(is_same_value(scene.at(Pointer(row.pointer)), expected));
        }
}

TEST(FieldTable, WhatIsOnePastARangeOrOfAnotherTypeIsRefusedByName) {
    for (const Row& row : rows)
        for (const char* value : row.bad)
            expect_refused(with_value(row, value), error_code::invalid_value, row.pointer,
                           row.says);
}

TEST(FieldTable, AnUnknownSiblingIsRefusedByName) {
    std::set<std::string> asked;
    for (const Row& row : rows) {
        const std::string pointer = row.pointer;
        const std::string sibling = pointer.substr(0, pointer.rfind('/')) + "/bogus";
        if (!asked.insert(sibling + row.within).second) continue;
        Json scene = scene_of(row);
        if (!scene.contains(Pointer(pointer).parent_pointer()))
            scene[Pointer(pointer).parent_pointer()] = Json::object();
        scene[Pointer(sibling)] = 1;
        expect_refused(scene, error_code::unknown_field, sibling, "is no field; there are");
    }
    EXPECT_GE(asked.size(), 9u);
}

// A field that is added without a row above fails here.
TEST(FieldTable, HasARowForEveryField) {
    std::set<std::string> have;
    for (const Row& row : rows) {
        std::string path = std::string(row.pointer).substr(1);
        std::replace(path.begin(), path.end(), '/', '.');
        have.insert(path);
    }
    for (const server::FieldPath& field : server::field_paths()) {
        std::string path = field.path;
        if (path.ends_with(".image")) path = path.substr(0, path.rfind('.'));
        if (path == "preset" || path == "light.type") continue;
        EXPECT_TRUE(have.contains(path)) << path;
    }
}

// What no schema of a single field can say: how values of a list, or of two fields, go together.
bool is_beyond_schemas(const Row& row, const Json& value) {
    const std::string pointer = row.pointer;
    if (pointer.ends_with("/falloff")) return value.is_array() && value.size() == 2;
    if (pointer == "/light/direction") return value == Json({0, 0, 0});
    return pointer == "/output/bitDepth" && value.is_number_integer() && value >= 8 && value <= 32;
}

TEST(FieldTable, TheDescriptionAgreesWithWhatIsTaken) {
    const Json document =
        Json::parse(server::openapi_json({.version = "0", .max_lights = 64, .problems = {}}));
    const JsonSchema judge(document);
    const Json& schema = document["components"]["schemas"]["Scene"];
    int judged = 0;
    for (const Row& row : rows) {
        for (const char* value : row.good) {
            const Json scene = with_value(row, value);
            EXPECT_TRUE(judge.accepts(schema, scene)) << scene;
            ++judged;
        }
        for (const char* value : row.bad) {
            if (is_beyond_schemas(row, Json::parse(value))) continue;
            const Json scene = with_value(row, value);
            EXPECT_FALSE(judge.accepts(schema, scene)) << scene;
            ++judged;
        }
    }
    EXPECT_GT(judged, 350);
    for (const char* refused :
         {R"({})", R"({"height": {"image": "h"}, "bogus": 1})",
          R"({"height": {"image": "h"}, "light": {"type": "point"}, "lights": [{"type": "point"}]})",
          R"({"height": {"image": "h"}, "light": {"type": "point", "azimuth": 1}})",
          R"({"height": {"image": "h"}, "light": {"type": "directional", "direction": [0, 0, 1], "azimuth": 1}})",
          R"({"height": {"image": "h"}, "light": {"position": [0, 0, 1]}})",
          R"({"height": {"image": "h"}, "light": {"type": "environment"}})",
          R"({"height": {"image": "h"}, "preset": "plastic"})"}) {
        EXPECT_FALSE(judge.accepts(schema, Json::parse(refused))) << refused;
        EXPECT_THROW((void)server::parse_scene(refused, 64), Error) << refused;
    }
}

TEST(FieldTable, TheDescriptionsDefaultsAreTheFields) {
    const Json document =
        Json::parse(server::openapi_json({.version = "0", .max_lights = 64, .problems = {}}));
    const Json scene = written({{"height", {{"image", "h"}}}});
    const Json& schemas = document["components"]["schemas"];
    int compared = 0;
    const std::function<void(const Json&, const Json&)> compare = [&](const Json& schema,
                                                                      const Json& value) {
        for (const auto& [name, property] : schema["properties"].items()) {
            if (property.contains("properties")) compare(property, value[name]);
            if (!property.contains("default")) continue;
            EXPECT_EQ(property["default"], value[name]) << name;
            ++compared;
        }
    };
    compare(schemas["Scene"], scene);
    EXPECT_GT(compared, 30);
}

}  // namespace
}  // namespace relit::test

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
#include "tests/support/json_schema.h"

namespace relit::test {
namespace {

using Json = nlohmann::json;
using Pointer = Json::json_pointer;

struct Row {
    const char* pointer;
    const char* default_value;      ///< JSON; "" where the field has none
    std::vector<const char*> good;  ///< both ends of the range among them
    std::vector<const char*> bad;   ///< one past each end and wrong types among them
    const char* says;               ///< part of every refusal's detail
    const char* within = "{}";      ///< a merge patch: what else the scene needs for this field
};

constexpr const char* sun = R"({"light": {"type": "directional"}})";
constexpr const char* sky = R"({"light": {"type": "environment", "image": {"image": "e"}}})";
constexpr const char* exr = R"({"output": {"format": "exr"}})";

const std::vector<const char*> good_colours = {R"("#000000")", R"("#FFffFF")", "[0, 0, 0]",
                                               "[10000, 1, 0.5]"};
const std::vector<const char*> bad_colours = {
    R"("#00000")",    R"("#0000000")",   R"("red")", "[0, 0]", "[0, 0, 0, 0]",
    "[0, -0.001, 0]", "[0, 0, 10000.1]", "7",        "true",   R"([0, 0, "1"])"};
const std::vector<const char*> bad_words = {R"("Beauty ")", R"("")", "1", "null", "[]", "true"};

std::vector<const char*> and_null(std::vector<const char*> values) {
    values.push_back("null");
    return values;
}

const Row rows[] = {
    {"/height",
     "",
     {R"({"image": "x"})", R"({"data": "AAAA"})", R"({"part": "p"})"},
     {R"("x")", "null", R"({"image": 1})", R"({"image": "a", "part": "b"})"},
     "height"},
    {"/alpha",
     "null",
     {"null", R"({"image": "x"})", R"({"part": "p"})"},
     {R"("x")", "1", R"({"data": []})"},
     "alpha"},
    {"/albedo",
     "null",
     {"null", R"({"image": "x"})", R"({"data": "AAAA"})"},
     {R"("x")", "1", R"({"part": null})"},
     "albedo"},
    {"/relief",
     "0.15",
     {"1e-300", "0.5", "10"},
     {"0", "-1", "10.0001", R"("1")", "null", "[1]"},
     "a number above 0 and at most 10"},
    {"/base",
     R"("none")",
     {R"("none")", R"("auto")", "-10", "10", "0"},
     {"-10.0001", "10.0001", R"("floor")", "null", "true"},
     "'none', 'auto' or a number from -10 to 10"},
    {"/normalScale",
     "1",
     {"0", "100"},
     {"-0.0001", "100.0001", R"("1")", "null"},
     "a number from 0 to 100"},
    {"/light",
     R"({"type":"point","position":[0.1,1,0.6],"color":"#ffffff","intensity":1})",
     {R"({"type": "point"})"},
     {"1", R"("point")", "null", "[]"},
     "an object"},
    {"/light/position",
     "[0.1,1,0.6]",
     {"[-1000, 1000, 0]", "[1000, -1000, -1000]"},
     {"[-1000.1, 0, 0]", "[0, 1000.1, 0]", "[0, 0, 1000.1]", "[0, 0]", "[0, 0, 0, 0]", "0", "null",
      R"([0, 0, "1"])"},
     "'light.position",
     R"({"light": {"type": "point"}})"},
    {"/light/color", R"("#ffffff")", good_colours, and_null(bad_colours), "'light.color",
     R"({"light": {"type": "point"}})"},
    {"/light/intensity",
     "1",
     {"0", "10000"},
     {"-0.001", "10000.1", R"("1")", "null"},
     "a number from 0 to 10000",
     R"({"light": {"type": "point"}})"},
    {"/light/azimuth",
     "315",
     {"-1000000", "1000000", "0"},
     {"-1000000.1", "1000000.1", R"("N")", "null"},
     "a number",
     sun},
    {"/light/elevation",
     "35",
     {"-90", "90"},
     {"-90.001", "90.001", R"("up")", "null"},
     "a number from -90 to 90",
     sun},
    {"/light/direction",
     "",
     {"[0, 0, 1]", "[-1e300, 1e300, 0.5]"},
     {"[0, 0, 0]", "[0, 1]", "1", "null", "[0, 0, true]"},
     "'light.direction",
     sun},
    {"/light/color", R"("#ffffff")", good_colours, and_null(bad_colours), "'light.color", sun},
    {"/light/intensity",
     "1",
     {"0", "10000"},
     {"-0.001", "10000.1", R"("1")", "null"},
     "a number from 0 to 10000",
     sun},
    {"/light/image",
     "",
     {R"({"image": "x"})", R"({"part": "p"})"},
     {"null", R"("x")", "[]"},
     "an object",
     sky},
    {"/light/rotation",
     "[0,0]",
     {"[-1000000, 1000000]", "[0, 0]"},
     {"[1000000.1, 0]", "[0, -1000000.1]", "[0]", "[0, 0, 0]", "0", "null"},
     "'light.rotation",
     sky},
    {"/light/intensity",
     R"("auto")",
     {R"("auto")", "0", "10000"},
     {"-0.001", "10000.1", R"("bright")", "null"},
     "'auto' or a number from 0 to 10000",
     sky},
    {"/light/weighting",
     R"("solid-angle")",
     {R"("solid-angle")", R"("uniform")"},
     bad_words,
     "'solid-angle' or 'uniform'",
     sky},
    {"/light/radius",
     "null",
     {"null", "1e-300", "1000"},
     {"0", "-1", "1000.1", R"("far")"},
     "null or a number above 0 and at most 1000",
     sky},
    {"/lights",
     "",
     {R"([{"type": "point"}])", R"([{"type": "point"}, {"type": "directional"}])"},
     {"[]", "{}", "null", R"("point")"},
     "a list of at least one light"},
    {"/material", "", {"{}", R"({"depth": 1})"}, {"null", "[]", "1"}, "an object"},
    {"/material/baseColor", R"("#000000")", good_colours, and_null(bad_colours),
     "'material.baseColor"},
    {"/material/diffuseColor", R"("#ffffff")", good_colours, and_null(bad_colours),
     "'material.diffuseColor"},
    {"/material/specularColor", R"("#ffffff")", good_colours, and_null(bad_colours),
     "'material.specularColor"},
    {"/material/depth",
     "0.008",
     {"1e-300", "10"},
     {"0", "-0.1", "10.0001", R"("deep")", "null"},
     "a number above 0 and at most 10"},
    {"/material/offset",
     R"("normal")",
     {R"("normal")", R"("view")"},
     bad_words,
     "'normal' or 'view'"},
    {"/material/illumination",
     R"("length")",
     {R"("length")", R"("exponential")", R"("count")"},
     bad_words,
     "'length', 'exponential' or 'count'"},
    {"/material/attenuation",
     "20",
     {"1e-300", "10000"},
     {"0", "-1", "10000.1", "null", "[]"},
     "a number above 0 and at most 10000"},
    {"/material/steps",
     "100",
     {"1", "10000"},
     {"0", "10001", "1.5", R"("1")", "null"},
     "a whole number from 1 to 10000"},
    {"/material/specular", "", {"{}"}, {"null", "0.5", "[]"}, "an object"},
    {"/material/specular/k",
     "0",
     {"0", "1", "0.5"},
     {"-0.0001", "1.0001", R"("1")", "null"},
     "a number from 0 to 1"},
    {"/material/specular/falloff",
     "[0,1]",
     {"[-1, 1]", "[0.5, 0.6]"},
     {"[-1.001, 0]", "[0, 1.001]", "[0.5, 0.5]", "[1, 0]", "[0]", "[0, 0.5, 1]", "1", "null"},
     "'material.specular.falloff"},
    {"/material/specular/occlude",
     "false",
     {"true", "false"},
     {"0", R"("true")", "null"},
     "true or false"},
    {"/material/scatter", "", {"{}"}, {"null", "0.5", "[]"}, "an object"},
    {"/material/scatter/k",
     "0",
     {"0", "1", "0.5"},
     {"-0.0001", "1.0001", R"("1")", "null"},
     "a number from 0 to 1"},
    {"/material/scatter/falloff",
     "[0,1]",
     {"[-1, 1]", "[0.5, 0.6]"},
     {"[-1.001, 0]", "[0, 1.001]", "[0.5, 0.5]", "[1, 0]", "[0]", "1", "null"},
     "'material.scatter.falloff"},
    {"/output", "", {"{}"}, {"null", "[]", R"("png")"}, "an object"},
    {"/output/format",
     R"("png")",
     {R"("png")", R"("jpeg")", R"("webp")", R"("exr")"},
     bad_words,
     "'png', 'jpeg', 'webp' or 'exr'"},
    {"/output/layer",
     R"("beauty")",
     {R"("beauty")", R"("illumination")", R"("thickness")", R"("normal")", R"("specular")",
      R"("scatter")", R"("height")", R"("alpha")"},
     bad_words,
     "'beauty', 'illumination'"},
    {"/output/accuracy",
     R"("final")",
     {R"("final")", R"("preview")"},
     bad_words,
     "'final' or 'preview'"},
    {"/output/width",
     "null",
     {"null", "1", "32768"},
     {"0", "32769", "1.5", R"("1")"},
     "whole number from 1 to 32768"},
    {"/output/height",
     "null",
     {"null", "1", "32768"},
     {"0", "32769", "1.5", R"("1")"},
     "whole number from 1 to 32768"},
    {"/output/region",
     "null",
     {"null", "[0, 0, 1, 1]", "[32768, 32768, 32768, 32768]"},
     {"[-1, 0, 1, 1]", "[0, 0, 0, 1]", "[0, 0, 1, 32769]", "[0, 0.5, 1, 1]", "[0, 0, 1]", "1"},
     "'output.region"},
    {"/output/bitDepth",
     "null",
     {"null", "8", "16"},
     {"7", "9", "32", "33", R"("8")", "8.5"},
     "'output.bitDepth"},
    {"/output/bitDepth", "null", {"null", "16", "32"}, {"8", "24", "33"}, "'output.bitDepth", exr},
    {"/output/quality",
     "85",
     {"1", "100"},
     {"0", "101", "50.5", R"("best")", "null"},
     "a whole number from 1 to 100"},
    {"/output/effort", R"("fast")", {R"("fast")", R"("small")"}, bad_words, "'fast' or 'small'"},
    {"/output/exposure",
     "0",
     {"-20", "20"},
     {"-20.001", "20.001", R"("0")", "null"},
     "a number from -20 to 20"},
    {"/output/tone", R"("clip")", {R"("clip")", R"("filmic")"}, bad_words, "'clip' or 'filmic'"},
    {"/output/transfer", R"("srgb")", {R"("srgb")", R"("none")"}, bad_words, "'srgb' or 'none'"},
    {"/output/background", "null", and_null(good_colours), bad_colours, "'output.background"},
};

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

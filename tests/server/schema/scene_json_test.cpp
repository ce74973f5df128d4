#include "server/schema/scene_json.h"

#include <gtest/gtest.h>

#include "server/error_codes.h"

namespace relit::test {
namespace {

using server::parse_scene;
using server::scene_json;

// A scene of the one required field and `rest`, a list of members.
std::string scene_with(const std::string& rest) {
    return R"({"height": {"image": "h"})" + (rest.empty() ? "" : ", " + rest) + "}";
}

struct Refusal {
    const char* scene;
    std::string_view code;
    const char* pointer;
    const char* says;
};

void expect_refused(const std::string& scene, std::string_view code, const std::string& pointer,
                    const std::string& says) {
    SCOPED_TRACE(scene.substr(0, 200));
    try {
        (void)parse_scene(scene, 3);
        ADD_FAILURE() << "accepted";
    } catch (const Error& e) {
        EXPECT_EQ(e.code, code);
        EXPECT_EQ(e.pointer, pointer);
        EXPECT_NE(std::string(e.what()).find(says), std::string::npos) << e.what();
    }
}

TEST(SceneJson, OfHeightAloneHasEveryDefault) {
    EXPECT_EQ(
        scene_json(parse_scene(scene_with(""), 1)),
        R"({"height":{"image":"h"},"alpha":null,"albedo":null,"bump":null,"bumpRelief":0.01,"relief":0.15,"base":"none","normalScale":1,)"
        R"("light":{"type":"point","position":[0.1,1,0.6],"color":"#ffffff","intensity":1},)"
        R"("material":{"model":"integrated","baseColor":"#000000","diffuseColor":"#ffffff","specularColor":"#ffffff","depth":0.008,)"
        R"("offset":"normal","illumination":"length","attenuation":20,"steps":100,)"
        R"("specular":{"k":0,"falloff":[0,1],"occlude":false},"scatter":{"k":0,"falloff":[0,1]},)"
        R"("medium":"marble","mmPerWidth":80,"dirdipoleEnergy":"published","bssrdfWeight":1,"diffuseWeight":0,"film":null,)"
        R"("highlight":{"lobe":"ward","transport":"subsurface","k":0,"nt":10,"nb":10,"exponent":10}},)"
        R"("output":{"format":"png","layer":"beauty","accuracy":"final","width":null,"height":null,"region":null,)"
        R"("bitDepth":null,"quality":85,"effort":"fast","exposure":0,"tone":"clip","transfer":"srgb","background":null}})");
}

TEST(SceneJson, WritesWhatItReads) {
    const char* scenes[] = {
        R"("light": {"type": "directional"})",
        R"("material": {"model": "dipole", "medium": {"sigmaA": [0, 1, 2], "sigmaS": [1, 2, 3]}, "film": {"thickness": 1, "g": 0.5}})",
        R"("light": {"type": "directional", "direction": [1, 2, -0.5], "color": [0.5, 1, 20]})",
        R"("light": {"type": "environment", "image": {"part": "sky"}, "rotation": [90, -10], "intensity": 2.5, "weighting": "uniform", "radius": 1})",
        R"("lights": [{"type": "point"}, {"type": "directional", "azimuth": 12, "elevation": -5}])",
        R"("alpha": {"data": "AAAA"}, "albedo": {"image": "a"}, "base": -0.01, "relief": 10)",
        R"("base": "auto", "output": {"format": "exr", "bitDepth": 16, "region": [1, 2, 3, 4], "width": 5, "background": "#0a0B0c"})",
    };
    for (const char* scene : scenes) {
        const std::string once = scene_json(parse_scene(scene_with(scene), 3));
        EXPECT_EQ(scene_json(parse_scene(once, 3)), once);
    }
}

TEST(SceneJson, IsTheSameTextForTheSameMeaning) {
    const std::string expected =
        scene_json(parse_scene(scene_with(R"("relief": 0.2, "material": {"depth": 1})"), 1));
    for (const char* same :
         {R"("material": {"depth": 1.0}, "relief": 2e-1)",
          R"("relief":0.20,"material":{"steps":1e2,"depth":1})",
          R"("relief": 0.2, "alpha": null, "material": {"depth": 1, "baseColor": "#000000"})",
          R"("preset": null, "relief": 0.2, "material": {"depth": 1})",
          R"("relief": 0.2, "lights": [{"type": "point"}], "material": {"depth": 1, "specular": {"k": -0.0}})"})
        EXPECT_EQ(scene_json(parse_scene(scene_with(same), 1)), expected) << same;
}

TEST(SceneJson, RefusesWhatIsWrongNamingTheField) {
    using namespace error_code;
    const Refusal refusals[] = {
        {R"("output": {"layer": "subsurface"})", error_code::invalid_value, "/output/layer",
         "needs a model of subsurface scattering"},
        {R"("material": {"model": "dipole", "illumination": "count"})", error_code::invalid_value,
         "/material/illumination", "subsurface scattering"},
        {R"("material": {"illumination": "count"}, "output": {"layer": "irradiance"})",
         error_code::invalid_value, "/material/illumination", "'irradiance'"},
        {R"("material": {"highlight": {"nt": 0}})", error_code::invalid_value,
         "/material/highlight/nt", "above 0"},
        {R"("material": {"medium": {"sigmaA": [1, 1, 1]}})", error_code::missing_field,
         "/material/medium/sigmaS", "missing"},
        {R"("material": {"medium": {"sigmaA": [1, 1, 1], "sigmaS": [1, 1, 1], "sigmaT": 1}})",
         error_code::unknown_field, "/material/medium/sigmaT", "'sigmaS'"},
        {R"("material": {"film": {"medium": "paint"}})", error_code::invalid_value,
         "/material/film/medium", "GET /v1/media"},
        {R"("relif": 1)", unknown_field, "/relif", "'relief'"},
        {R"("material": {"specular": {"K": 1}})", unknown_field, "/material/specular/K",
         "'k', 'falloff' and 'occlude'"},
        {R"("light": {"type": "point", "azimuth": 1})", unknown_field, "/light/azimuth",
         "'position'"},
        {R"("relief": "high")", invalid_value, "/relief", "a number above 0 and at most 10"},
        {R"("relief": 0)", invalid_value, "/relief", "above 0"},
        {R"("relief": 10.001)", invalid_value, "/relief", "at most 10"},
        {R"("relief": null)", invalid_value, "/relief", "number"},
        {R"("relief": true)", invalid_value, "/relief", "number"},
        {R"("relief": 1e400)", invalid_value, "/relief", "too large"},
        {R"("material": {"steps": 2.5})", invalid_value, "/material/steps",
         "whole number from 1 to 10000"},
        {R"("material": {"steps": 0})", invalid_value, "/material/steps", "whole number"},
        {R"("material": {"offset": "Normal"})", invalid_value, "/material/offset",
         "'normal' or 'view'"},
        {R"("material": {"baseColor": "#12345g"})", invalid_value, "/material/baseColor", "#rrggbb"},
        {R"("material": {"baseColor": [1, 2]})", invalid_value, "/material/baseColor", "[r, g, b]"},
        {R"("material": {"baseColor": [1, 2, -1]})", invalid_value, "/material/baseColor/2",
         "from 0 to 10000"},
        {R"("material": {"specular": {"falloff": [0.5, 0.5]}})", invalid_value,
         "/material/specular/falloff", "below"},
        {R"("material": {"scatter": {"falloff": [-1.5, 0.5]}})", invalid_value,
         "/material/scatter/falloff/0", "from -1 to 1"},
        {R"("material": {"specular": {"occlude": 1}})", invalid_value, "/material/specular/occlude",
         "true or false"},
        {R"("material": [])", invalid_value, "/material", "object"},
        {R"("base": "floor")", invalid_value, "/base", "'none', 'auto' or a number"},
        {R"("base": -10.5)", invalid_value, "/base", "from -10 to 10"},
        {R"("light": {"position": [0, 0, 1]})", missing_field, "/light/type",
         "'light.type' is missing"},
        {R"("light": {"type": "spot"})", invalid_value, "/light/type", "'directional'"},
        {R"("light": {"type": "point", "position": [0, 0]})", invalid_value, "/light/position",
         "3 numbers"},
        {R"("light": {"type": "point", "position": [0, 0, 1001]})", invalid_value,
         "/light/position/2", "1000"},
        {R"("light": {"type": "point", "intensity": -1})", invalid_value, "/light/intensity",
         "from 0 to 10000"},
        {R"("light": {"type": "directional", "elevation": 91})", invalid_value, "/light/elevation",
         "from -90 to 90"},
        {R"("light": {"type": "directional", "direction": [0, 0, 0]})", invalid_value,
         "/light/direction", "length 0"},
        {R"("light": {"type": "directional", "direction": [0, 0, 1], "azimuth": 3})", invalid_value,
         "/light/direction", "in place of"},
        {R"("light": {"type": "environment"})", missing_field, "/light/image", "missing"},
        {R"("light": {"type": "environment", "image": {}})", missing_field, "/light/image/image",
         "id"},
        {R"("light": {"type": "environment", "image": {"image": "a", "part": "b"}})", invalid_value,
         "/light/image", "more than one"},
        {R"("light": {"type": "environment", "image": {"image": "a"}, "radius": 0})", invalid_value,
         "/light/radius", "null or a number above 0"},
        {R"("light": {"type": "environment", "image": {"image": "a"}, "intensity": null})",
         invalid_value, "/light/intensity", "'auto' or a number"},
        {R"("light": {"type": "point"}, "lights": [{"type": "point"}])", invalid_value, "/lights",
         "exclude each other"},
        {R"("lights": [])", invalid_value, "/lights", "at least one"},
        {R"("lights": [{"type": "point"}, {"type": "point", "intensity": "x"}])", invalid_value,
         "/lights/1/intensity", "number"},
        {R"("lights": [{"type": "point"},{"type": "point"},{"type": "point"},{"type": "point"}])",
         invalid_value, "/lights", "the limit is 3 (max-lights)"},
        {R"("output": {"region": [0, 0, 0, 5]})", invalid_value, "/output/region/2", "from 1"},
        {R"("output": {"region": [0, 0, 5]})", invalid_value, "/output/region", "4 whole numbers"},
        {R"("output": {"width": 0})", invalid_value, "/output/width", "from 1 to"},
        {R"("output": {"width": "wide"})", invalid_value, "/output/width", "null or a whole number"},
        {R"("output": {"format": "jpeg", "bitDepth": 16})", invalid_value, "/output/bitDepth",
         "8 with jpeg"},
        {R"("output": {"bitDepth": 32})", invalid_value, "/output/bitDepth", "8 or 16 with png"},
        {R"("output": {"format": "exr", "bitDepth": 8})", invalid_value, "/output/bitDepth",
         "16 or 32 with exr"},
        {R"("output": {"quality": 101})", invalid_value, "/output/quality", "from 1 to 100"},
        {R"("output": {"exposure": -20.5})", invalid_value, "/output/exposure", "from -20 to 20"},
        {R"("output": {"layer": "shadow"})", invalid_value, "/output/layer", "'beauty'"},
        {R"("material": {"illumination": "count"}, "light": {"type": "directional"})",
         invalid_value, "/material/illumination", "finite distance"},
        {R"("material": {"illumination": "count"}, "output": {"layer": "thickness"})",
         invalid_value, "/output/layer", "count"},
        {R"("light": {"type": "environment", "image": {"image": "a"}}, "output": {"layer": "thickness"})",
         invalid_value, "/output/layer", "environment"},
        {R"("preset": "plastic")", invalid_value, "/preset", "'thesis'"},
        {R"("relief": 1, "relief": 1)", duplicate_field, "/relief", "twice"},
        {R"("lights": [{"type": "point", "a/b": 1, "a/b": 2}])", duplicate_field, "/lights/0/a~1b",
         "twice"},
    };
    for (const Refusal& refusal : refusals)
        expect_refused(scene_with(refusal.scene), refusal.code, refusal.pointer, refusal.says);
}

TEST(SceneJson, RefusesTextThatIsNoScene) {
    using namespace error_code;
    expect_refused("", malformed_json, "", "byte");
    expect_refused("{", malformed_json, "", "byte");
    expect_refused(R"({"height": {"image": "h"}} x)", malformed_json, "", "byte 28");
    expect_refused("\"\xff\"", malformed_json, "", "byte");
    expect_refused("[]", invalid_value, "", "object");
    expect_refused("{}", missing_field, "/height", "'height' is missing");
    expect_refused(R"({"height": "abc"})", invalid_value, "/height", "object");
    expect_refused(R"({"height": {"image": 7}})", invalid_value, "/height/image", "string");
    std::string deep_pointer;
    for (int level = 0; level < 64; ++level) deep_pointer += "/0";
    expect_refused(std::string(200000, '['), malformed_json, deep_pointer, "deeper than 64");
}

TEST(SceneJson, DepthAndNumberOfValuesHaveLimitsByName) {
    const auto words = [](const std::string& json, const server::JsonLimits& limits) {
        try {
            (void)parse_scene(json, 1, limits);
        } catch (const Error& error) {
            return std::string(error.code) + ": " + error.what();
        }
        return std::string("accepted");
    };
    // The scene, its height, the id, and one number.
    const std::string scene = scene_with(R"("relief": 0.2)");
    EXPECT_EQ(words(scene, {.max_depth = 2, .max_values = 4}), "accepted");
    EXPECT_EQ(words(scene, {.max_depth = 2, .max_values = 3}),
              "malformed-json: the JSON has more than 3 values (max-json-values)");
    EXPECT_EQ(words(scene, {.max_depth = 1}),
              "malformed-json: the JSON is nested deeper than 1 levels (max-json-depth)");
}

TEST(SceneJson, UnusedFieldsAreCheckedLikeAnyOther) {
    expect_refused(scene_with(R"("material": {"illumination": "length", "attenuation": 0})"),
                   error_code::invalid_value, "/material/attenuation", "above 0");
    expect_refused(scene_with(R"("output": {"format": "png", "quality": 0})"),
                   error_code::invalid_value, "/output/quality", "from 1");
}

TEST(SceneJson, EveryRangeIncludesItsEnds) {
    for (const char* fine :
         {R"("relief": 10)", R"("relief": 1e-9)", R"("base": -10)", R"("base": 10)",
          R"("normalScale": 0)", R"("normalScale": 100)",
          R"("material": {"depth": 10, "attenuation": 10000, "steps": 1})",
          R"("material": {"steps": 10000})",
          R"("material": {"specular": {"k": 1, "falloff": [-1, 1]}, "scatter": {"k": 0, "falloff": [-1, -0.5]}})",
          R"("light": {"type": "point", "position": [-1000, 1000, 0], "intensity": 10000, "color": [10000, 0, 0]})",
          R"("light": {"type": "directional", "azimuth": -3600, "elevation": -90, "intensity": 0})",
          R"("light": {"type": "environment", "image": {"image": "a"}, "radius": 1000, "rotation": [3600, -3600]})",
          R"("output": {"exposure": 20, "quality": 1})",
          R"("output": {"exposure": -20, "quality": 100, "width": 1, "height": 32768})"})
        EXPECT_NO_THROW((void)parse_scene(scene_with(fine), 1)) << fine;
}

TEST(SceneJson, PresetLiesUnderTheScene) {
    const auto scene = parse_scene(
        scene_with(R"("preset": "thesis", "relief": 0.5, "material": {"depth": 0.01})"), 1);
    EXPECT_EQ(scene.relief, 0.5);
    EXPECT_EQ(scene.material.depth, 0.01);
    EXPECT_EQ(scene.material.illumination, Illumination::count);
    EXPECT_EQ(scene.material.offset, Offset::view);
    EXPECT_EQ(scene.output.picture.transfer, Transfer::none);
    const auto& light = std::get<PointLight>(scene.lights.at(0));
    EXPECT_EQ(light.position, (Vec3{0.3, 0.8, 1.4}));
    EXPECT_EQ(light.intensity, 2);
}

TEST(SceneJson, PresetsLightIsMergedByItsOwnTypeAndReplacedByAnother) {
    const auto same =
        parse_scene(scene_with(R"("preset": "thesis", "light": {"position": [0, 0, 2]})"), 1);
    EXPECT_EQ(std::get<PointLight>(same.lights.at(0)).intensity, 2);
    const auto other = parse_scene(
        scene_with(
            R"("preset": "thesis", "light": {"type": "directional"}, "material": {"illumination": "length"})"),
        1);
    EXPECT_EQ(std::get<DirectionalLight>(other.lights.at(0)).intensity, 1);
    const auto several =
        parse_scene(scene_with(R"("preset": "thesis", "lights": [{"type": "point"}])"), 1);
    EXPECT_EQ(std::get<PointLight>(several.lights.at(0)).intensity, 1);
}

TEST(SceneJson, NullOverAPresetIsTheDefault) {
    const auto text = [](const std::string& rest) {
        return scene_json(parse_scene(scene_with(rest), 3));
    };
    const auto scene =
        parse_scene(scene_with(R"("preset": "thesis", "output": {"transfer": null})"), 1);
    EXPECT_EQ(scene.output.picture.transfer, Transfer::srgb);
    const std::string bronze = text(R"("preset": "bronze")");
    // What the preset does not set.
    EXPECT_EQ(text(R"("preset": "bronze", "normalScale": null, "output": null, "lights": null)"),
              bronze);
    EXPECT_EQ(text(R"("preset": "bronze", "material": {"scatter": {"k": null}})"), bronze);
    // What it does set, fields that hold others too.
    EXPECT_EQ(std::get<PointLight>(
                  parse_scene(scene_with(R"("preset": "bronze", "light": null)"), 1).lights.at(0))
                  .position,
              PointLight{}.position);
    EXPECT_EQ(parse_scene(scene_with(R"("preset": "wax", "lights": null)"), 1).lights.size(), 1u);
    EXPECT_EQ(parse_scene(scene_with(R"("preset": "wax", "light": null)"), 2).lights.size(), 2u);
    EXPECT_EQ(parse_scene(scene_with(R"("preset": "bronze", "material": null)"), 1).material.depth,
              Material{}.depth);
    // An unknown field is one whatever it holds, and height must be there.
    expect_refused(scene_with(R"("preset": "thesis", "bogus": null)"), error_code::unknown_field,
                   "/bogus", "is no field");
    expect_refused(R"({"preset": "thesis", "height": null})", error_code::missing_field, "/height",
                   "missing");
    expect_refused(scene_with(R"("preset": "bronze", "light": {"type": null})"),
                   error_code::missing_field, "/light/type", "missing");
}

TEST(SceneJson, ImageOfAPresetIsReplacedWholeByOneOfAnotherKind) {
    for (const char* kind : {"image", "data", "part"}) {
        const auto scene = parse_scene(scene_with(R"("preset": "ink", "light": {"image": {")" +
                                                  std::string(kind) + R"(": "x"}})"),
                                       1);
        EXPECT_EQ(std::get<server::EnvironmentDescription>(scene.lights.at(0)).image.text, "x")
            << kind;
    }
}

}  // namespace
}  // namespace relit::test

// The fields as paths: each one is a field, each word one of its values.
#include "server/schema/field_paths.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "server/error_codes.h"
#include "server/schema/scene_json.h"
#include "server/schema/settings.h"

namespace relit::test {
namespace {

using namespace server;

bool takes(const std::string& scene, const std::string& path, const std::string& value) {
    try {
        (void)parse_scene(with_settings(scene, {{path, value}}), 1);
        return true;
    } catch (const Error& e) {
        return value.empty() && e.code == error_code::invalid_value;
    }
}

// Whether a scene takes the value, with a light of some type and a material of some model.
bool some_scene_takes(const std::string& path, const std::string& value) {
    for (const std::string light : {R"("type": "point")", R"("type": "directional")",
                                    R"("type": "environment", "image": {"image": "a"})"})
        for (const std::string model : {"integrated", "dipole"})
            if (takes(R"({"height": {"image": "a"}, "light": {)" + light +
                          R"(}, "material": {"model": ")" + model + R"("}})",
                      path, value))
                return true;
    return false;
}

TEST(FieldPaths, EachIsAFieldAndEachWordAValueOfIt) {
    const std::vector<FieldPath> paths = field_paths();
    ASSERT_GT(paths.size(), 40u);
    for (const FieldPath& field : paths) {
        EXPECT_TRUE(some_scene_takes(field.path, "")) << field.path;
        EXPECT_FALSE(field.sentence.empty()) << field.path;
        for (const std::string& word : field.words)
            EXPECT_TRUE(some_scene_takes(field.path, word)) << field.path << '=' << word;
    }
    EXPECT_FALSE(some_scene_takes("material.shine", "")) << "the test itself";
}

TEST(FieldPaths, NameEveryPartOfAScene) {
    const std::vector<FieldPath> paths = field_paths();
    const auto count = [&](const char* path) {
        return std::count_if(paths.begin(), paths.end(),
                             [&](const FieldPath& field) { return field.path == path; });
    };
    for (const char* path : {"height.image", "albedo.image", "relief", "base", "light.type",
                             "light.position", "light.azimuth", "light.image.image",
                             "light.intensity", "material.specular.k", "output.region"})
        EXPECT_EQ(count(path), 1) << path;
}

TEST(HasField, LooksAtTheSceneItself) {
    const char* scene = R"({"preset": "wax", "output": {"width": null}, "relief": 1})";
    EXPECT_TRUE(has_field(scene, "relief"));
    EXPECT_TRUE(has_field(scene, "output.width"));
    EXPECT_FALSE(has_field(scene, "output.format"));
    EXPECT_FALSE(has_field(scene, "base"));
    EXPECT_FALSE(has_field(scene, "relief.k"));
}

}  // namespace
}  // namespace relit::test

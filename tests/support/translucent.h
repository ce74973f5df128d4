// Scenes of translucent materials and what light does at their texels, for tests of what render() makes
// of them.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/field/normals.h"
#include "core/render/render.h"
#include "core/scatter/fresnel.h"
#include "core/visibility/inside_length.h"
#include "tests/support/maps.h"

namespace relit::test {

inline const Output raw{.transfer = Transfer::none};

inline Output layer(Layer which) { return {.layer = which, .transfer = Transfer::none}; }

inline Material dipole_of(const char* medium, double mm_per_width) {
    Material m;
    m.model = Model::dipole;
    m.medium = scatter::find_medium(medium)->medium;
    m.mm_per_width = mm_per_width;
    return m;
}

inline Scene scene_of(HeightField field, Material material, Light light = DirectionalLight{}) {
    Scene scene;
    scene.field = shared(std::move(field));
    scene.material = std::move(material);
    scene.lights = {std::move(light)};
    return scene;
}

inline DirectionalLight sun(double elevation_deg, double azimuth_deg = 315) {
    return {.azimuth_deg = azimuth_deg, .elevation_deg = elevation_deg};
}

inline HeightField flat(int width, int height) {
    return field_of(width, height, [](int, int) { return 0.5; });
}

inline double at_middle(const Image& image, int c = 0) {
    return image.at(image.width / 2, image.height / 2, c);
}

inline double rms(const Image& image, const Image& expected) {
    double errors = 0, squares = 0;
    for (std::size_t n = 0; n < image.values.size(); ++n) {
        const double e = double(image.values[n]) - expected.values[n];
        errors += e * e;
        squares += double(expected.values[n]) * expected.values[n];
    }
    return std::sqrt(errors / squares);
}

// E/pi and B/pi of one texel under one light of intensity 1, by the scalar march.
struct Lit {
    double irradiance = 0, entering = 0, visibility = 0;
    Vec3 to_light;
};

inline Lit lit_texel(const Scene& scene, const Solid& solid, int i, int j) {
    const HeightField& field = *scene.field;
    const LightSample light =
        samples_of(scene.lights.front(), {solid.y_size()}, Transfer::none, {}).front();
    const Ray ray = ray_to({light.at, light.at_infinity}, surface_point(solid, i, j));
    const Vec3 normal = normal_from(slopes_at(field, scene.relief, i, j));
    const double cosine = std::max(0.0, dot(normal, ray.direction));
    const double r = inside_length(solid, ray), t = scene.material.depth;
    const double visible = r > t ? t / r : 1;
    const double eta = scene.material.medium.eta;
    return {visible * cosine, visible * cosine * scatter::transmittance(cosine, eta), visible,
            ray.direction};
}

}  // namespace relit::test

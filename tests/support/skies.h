// Environments that are made, not photographed: a sun in a sky, soft boxes in a dark studio.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/light/environment.h"

namespace relit::test {

/// radiance(to_light) at every texel of a map of 2 size x size.
template <class Radiance>
std::shared_ptr<const Image> environment_of(int size, const Radiance& radiance) {
    Image map(2 * size, size, 3);
    for (int j = 0; j < map.height; ++j)
        for (int i = 0; i < map.width; ++i) {
            const Rgb c = radiance(environment_direction(i, j, map.width, map.height));
            map.at(i, j, 0) = float(c.r);
            map.at(i, j, 1) = float(c.g);
            map.at(i, j, 2) = float(c.b);
        }
    return std::make_shared<const Image>(std::move(map));
}

/// 1 within `radius_rad` of `centre`, falling to 0 over `edge_rad`.
inline double soft_disc(Vec3 to_light, Vec3 centre, double radius_rad, double edge_rad) {
    const double angle = std::acos(std::clamp(dot(to_light, normalized(centre)), -1.0, 1.0));
    const double t = std::clamp((radius_rad + edge_rad / 2 - angle) / edge_rad, 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

/// A blue sky, brighter above, with a sun of 11 degrees across that gives half of the light.
inline std::shared_ptr<const Image> sun_and_sky(int size) {
    return environment_of(size, [](Vec3 l) {
        const double sky = 0.5 + 0.3 * l.y;
        const double sun = 60 * soft_disc(l, {-0.6, 0.5, 0.6}, 0.08, 0.04);
        return Rgb{0.6 * sky + sun, 0.8 * sky + 0.85 * sun, sky + 0.65 * sun};
    });
}

/// The same sky with a sun of a single texel that gives about half of the light.
inline std::shared_ptr<const Image> sun_in_the_sky(int size) {
    const auto sky = environment_of(size, [](Vec3 l) {
        const double blue = 0.5 + 0.3 * l.y;
        return Rgb{0.6 * blue, 0.8 * blue, blue};
    });
    Image map = *sky;
    const float sun[] = {1, 0.85f, 0.65f};
    for (int c = 0; c < 3; ++c)
        map.at(size * 3 / 4, size / 4, c) = 0.5f * float(map.texels()) * sun[c];
    return std::make_shared<const Image>(std::move(map));
}

/// Three coloured lamps behind wide cloths.
inline std::shared_ptr<const Image> soft_boxes(int size) {
    return environment_of(size, [](Vec3 l) {
        const double left = soft_disc(l, {-0.7, 0.5, 0.5}, 0.5, 0.3);
        const double right = soft_disc(l, {0.8, 0.1, 0.5}, 0.45, 0.3);
        const double above = soft_disc(l, {0, 0.9, 0.3}, 0.4, 0.3);
        return Rgb{0.05 + 3 * left + 0.5 * right + above, 0.05 + 2.5 * left + right + above,
                   0.05 + 2 * left + 2 * right + above};
    });
}

/// As bright from everywhere.
inline std::shared_ptr<const Image> white_sky(int size) {
    return environment_of(size, [](Vec3) { return Rgb{1, 1, 1}; });
}

}  // namespace relit::test

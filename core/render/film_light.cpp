#include "core/render/film_light.h"

#include <algorithm>
#include <numbers>

namespace relit {
namespace {

// `of` each colour's number.
template <class Of>
Rgb per_colour(const Of& of) {
    return {of(0), of(1), of(2)};
}

// Light scattered in the layer, as far as it goes: directions in the layer's own frame.
double scattered_back(const scatter::ThinLayer& layer, Vec3 to_light, Vec3 normal) {
    // Any frame about the normal: the layer looks the same all round.
    const Vec3 across = normalized(std::abs(normal.x) < 0.9 ? Vec3{0, normal.z, -normal.y}
                                                            : Vec3{-normal.z, 0, normal.x});
    const Vec3 along{normal.y * across.z - normal.z * across.y,
                     normal.z * across.x - normal.x * across.z,
                     normal.x * across.y - normal.y * across.x};
    const auto local = [&](Vec3 v) { return Vec3{dot(v, across), dot(v, along), dot(v, normal)}; };
    return scatter::reflected(layer, local(to_light), local({0, 0, 1}));
}

}  // namespace

FilmLight::FilmLight(const Film& film, double body_eta) {
    scatter::Medium medium = film.medium;
    if (film.g) medium.g.fill(*film.g);
    for (int c = 0; c < 3; ++c) {
        layers_.push_back(
            scatter::thin_layer(scatter::channel(medium, c), film.thickness, body_eta));
        tables_.emplace_back(layers_.back());
    }
    constexpr int steps = 64;
    for (int n = 0; n < steps; ++n) {
        const double cosine = (n + 0.5) / steps;
        diffuse_entering_ = diffuse_entering_ + 2 * cosine / steps * entering(cosine);
    }
}

Rgb FilmLight::entering(double cosine) const {
    return per_colour([&](int c) {
        return scatter::unscattered(layers_[c], cosine) + tables_[c].transmitted(cosine);
    });
}

Rgb FilmLight::leaving(double cosine) const {
    return per_colour([&](int c) { return scatter::unscattered(layers_[c], cosine); });
}

Rgb FilmLight::reflected(Vec3 to_light, Vec3 normal) const {
    return per_colour(
        [&](int c) { return std::numbers::pi * scattered_back(layers_[c], to_light, normal); });
}

Rgb FilmLight::diffuse_reflected(double cosine) const {
    return per_colour([&](int c) { return tables_[c].reflected(cosine); });
}

}  // namespace relit

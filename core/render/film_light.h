// A film on the surface as the lights of a scene meet it: what it lets through to the body below and
// back, and what it scatters back to the viewer. For surface_light.cpp and translucent_light.cpp.
// Source: translucency, section 6, "Two-layer body".
#pragma once

#include <vector>

#include "core/base/vec.h"
#include "core/image/colour.h"
#include "core/scatter/thin_layer.h"
#include "core/shade/material.h"

namespace relit {

class FilmLight {
public:
    /// @param body_eta  refractive index of the body below, over what is above the film
    FilmLight(const Film& film, double body_eta);

    /// Share of light that reaches the body: T_0 + T_1, unscattered and scattered once.
    /// @param cosine  n . w_i in [0, 1]
    [[nodiscard]] Rgb entering(double cosine) const;
    /// The same of light from all directions alike.
    [[nodiscard]] Rgb diffuse_entering() const { return diffuse_entering_; }
    /// Share of light from the body that leaves unscattered: T_0. @param cosine  n . v in [0, 1]
    [[nodiscard]] Rgb leaving(double cosine) const;
    /// pi f_r,1 towards the viewer at (0, 0, 1). @param to_light, normal  unit vectors
    [[nodiscard]] Rgb reflected(Vec3 to_light, Vec3 normal) const;
    /// The same of light from all directions alike: R_1. @param cosine  n . v in [0, 1]
    [[nodiscard]] Rgb diffuse_reflected(double cosine) const;

private:
    std::vector<scatter::ThinLayer> layers_;  // of red, green, blue
    std::vector<scatter::LayerTable> tables_;
    Rgb diffuse_entering_;
};

}  // namespace relit

// What the solid is made of: the parameters of all material models, plain data with the defaults of
// the interface. Sources: integrated model, sections 2, 4 and 5; translucency, sections 1, 2 and 5.
#pragma once

#include <optional>

#include "core/image/colour.h"
#include "core/scatter/directional_dipole.h"
#include "core/scatter/lobes.h"
#include "core/scatter/medium.h"

namespace relit {

/// How light becomes colour.
enum class Model {
    integrated,            ///< Perumal 2017: d of one path
    dipole,                ///< Jensen and others 2001
    better_dipole,         ///< d'Eon 2012
    directional_dipole,    ///< Frisvad and others 2014
    normalised_diffusion,  ///< Christensen and Burley 2015
};

/// Which d is made of r (section 2 of the integrated model).
enum class Illumination {
    length,       ///< min(1, t / r)
    exponential,  ///< exp(-a max(0, r - t))
    count,        ///< 1 / s: samples inside, the thesis's code; needs lights at a finite distance
};

/// Which way p' lies under the surface (section 2).
enum class Offset {
    normal,  ///< along the surface normal
    view,    ///< along the view vector
};

/// ramp(c; lo, hi) rises from 0 at lo to 1 at hi; -1 <= lo < hi <= 1 (section 4).
struct Falloff {
    double lo = 0;
    double hi = 1;
};

struct Specular {
    double k = 0;  ///< k_s in [0, 1]
    Falloff falloff;
    bool occlude = false;  ///< highlights are shadowed by d
};

struct Scatter {
    double k = 0;  ///< k_f in [0, 1]
    Falloff falloff;
};

/// A thin layer on the surface (translucency, section 6).
struct Film {
    scatter::Medium medium = scatter::find_medium("epidermis")->medium;
    double thickness = 0.01;    ///< mm, > 0
    std::optional<double> g{};  ///< in place of the medium's, in (-1, 1)
};

/// Where the light of a highlight enters.
enum class HighlightTransport {
    local,       ///< where it leaves: an ordinary highlight
    subsurface,  ///< all around, carried below the surface (translucency, section 5.2)
};

/// A highlight of the translucent models (translucency, section 5).
struct Highlight {
    scatter::LobeKind lobe = scatter::LobeKind::ward;
    HighlightTransport transport = HighlightTransport::subsurface;
    double k = 0;  ///< k_h, >= 0
    double n_t = 10;
    double n_b = 10;
    double exponent = 10;  ///< of the lobes cosine and lafortune
};

struct Material {
    Model model = Model::integrated;
    Colour base_colour = hex_colour(0, 0, 0);            ///< c_B
    Colour diffuse_colour = hex_colour(255, 255, 255);   ///< c_D
    Colour specular_colour = hex_colour(255, 255, 255);  ///< c_S
    double depth = 0.008;                                ///< t, scene units, > 0
    Offset offset = Offset::normal;
    Illumination illumination = Illumination::length;
    double attenuation = 20;  ///< a, 1/scene unit, > 0
    int steps = 100;          ///< S of `count`, >= 1
    Specular specular;
    Scatter scatter;
    // Of the translucent models.
    scatter::Medium medium = scatter::find_medium("marble")->medium;
    double mm_per_width = 80;  ///< what a scene unit is, > 0
    /// Of the directional dipole (section 3).
    scatter::DirectionalEnergy directional_energy = scatter::DirectionalEnergy::published;
    double bssrdf_weight = 1;   ///< wBssrdf, >= 0 (section 2.4)
    double diffuse_weight = 0;  ///< wDiffuse, >= 0
    std::optional<Film> film{};
    Highlight highlight;

    [[nodiscard]] bool is_translucent() const { return model != Model::integrated; }
};

}  // namespace relit

// Light that arrives on the surface of a scene, for the models that carry it on below: irradiance,
// what of it enters, what a film reflects, and highlights as they are where light enters. For
// translucency.h. Source: translucency, sections 2.1, 5.2 and 6.
//
// A light of intensity 1 gives a surface across its way the irradiance pi, so that matt white shows
// the light's own colour, as with the integrated model. An environment counts as there: its weights
// sum to 1 over the sphere. Nothing falls off with distance.
#pragma once

#include "core/image/image.h"
#include "core/render/film_light.h"
#include "core/render/output.h"
#include "core/render/prepared.h"

namespace relit {

/// Which quantities are asked for.
struct SurfaceLightParts {
    bool entering = false;
    bool highlight = false;
    bool reflected = false;  ///< by the film
    bool inward = false;     ///< with `entering` only
};

/// RGB per texel of the map, what was not asked for empty. 0 at texels that are no material.
struct SurfaceLight {
    /// E / pi: sum over lights of V cos_i. V in [0, 1] is what the way from the surface to the light
    /// leaves: min(1, t / r), or exp(-a r) with Illumination::exponential.
    Image irradiance;
    Image entering;  ///< B / pi: the same with T(cos_i), or through the film
    /// B / pi at the back of a panel, straight behind the texel; empty over endless ground. Nothing
    /// stands between a back and a light, and no film is on it.
    Image entering_behind;
    /// w_12, into the surface: the mean over lights weighted by the luminance of what enters, shorter
    /// than 1 where there are several. Diffuse light of a sky goes down the normal, as long as the mean
    /// of all that enters of it. A film bends light as the body below it does. 0 where nothing enters.
    Image inward;
    Image highlight;            ///< sum over lights of f V, f one of scatter/lobes.h
    Image reflected;            ///< radiance that the film scatters back to the viewer
    int coarse_directions = 0;  ///< as SkyLight::coarse_directions(), the fewest of all lights
};

/// @param film  the material's; null: it has none, or nothing that enters or is reflected is asked for
/// @pre not Illumination::count
/// @throws Error cancelled
[[nodiscard]] SurfaceLight surface_light(const Scene& scene, const Output& output,
                                         const PreparedSolid& prepared, SurfaceLightParts parts,
                                         const FilmLight* film, const RenderControl& control);

}  // namespace relit

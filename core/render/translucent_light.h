// What a translucent material shows: light that enters all over the surface, carried below it by the
// material's model, leaves towards the viewer; with it matt reflection, a film, and highlights. For
// the shader. Source: translucency, sections 2 to 6.
#pragma once

#include "core/image/image.h"
#include "core/render/output.h"
#include "core/render/prepared.h"

namespace relit {

/// RGB per texel of the map, what nobody needs empty.
struct TranslucentLight {
    Image matt;   ///< what textures multiply: wBssrdf L_o + wDiffuse E / pi (section 2.4)
    Image sheen;  ///< what is added to it: the film's reflection and k_h H
    Image layer;  ///< of the layers irradiance, subsurface (L_o) and highlight (k_h H)
    bool is_coarse = false;     ///< it was carried below the surface as a preview allows
    int coarse_directions = 0;  ///< of an environment, where a preview takes fewer; else 0
};

/// What the output's layer of a scene takes of it: nothing where neither the material is translucent
/// nor the layer is one of those above.
/// @pre not Illumination::count where something is needed; the layers subsurface and highlight only of
///      translucent materials
/// @throws Error cancelled
[[nodiscard]] TranslucentLight translucent_light(const Scene& scene, const Output& output,
                                                 const PreparedSolid& prepared,
                                                 const RenderControl& control);

}  // namespace relit

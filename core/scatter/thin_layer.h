// A thin layer that scatters once: what it reflects, what it lets through, and what goes through
// unscattered. For films over other bodies (skin, scales) and for single sheets (fins).
//
// Local vectors: z is the layer's normal; w_i points to the light, z > 0; w_o to the viewer, z > 0
// above the layer and z < 0 below. Primed cosines are those inside. BSDFs: L = f L_i cos_i dw.
// Internal reflections and higher orders are dropped: the layer loses light, never gains.
//
// Source: Hanrahan and Krueger 1993, "Reflection from layered surfaces due to subsurface
// scattering"; specification "translucency", section 6, which settles cosines and factors.
#pragma once

#include <array>
#include <span>
#include <string_view>

#include "core/base/vec.h"
#include "core/scatter/medium.h"

namespace relit::scatter {

/// p(cos_j), 1/sr: integrates to 1 over the sphere, mean cosine g. Henyey and Greenstein 1941.
/// @param cosine  between the directions of propagation before and after. @pre |g| < 1
[[nodiscard]] double henyey_greenstein(double cosine, double g);

struct ThinLayer {
    double tau = 0;           ///< optical depth sigma_t d, >= 0; may be infinite
    double albedo = 1;        ///< W, in [0, 1]
    double g = 0;             ///< in (-1, 1); above 0 forward
    double eta = 1;           ///< of the layer over what is above it, >= 1
    double eta_below = 1;     ///< n_3, of what is below over what is above, > 0
    bool hk_literal = false;  ///< (1 - R) once more in f_r1 and f_t1, as HK93 prints it
};

/// Of a medium, `thickness` in the coefficients' unit of length.
[[nodiscard]] ThinLayer thin_layer(const Coefficients& coefficients, double thickness,
                                   double eta_below = 1);

/// f_r1, 1/sr: scattered once and back out; 0 when either direction is below.
[[nodiscard]] double reflected(const ThinLayer& layer, Vec3 w_i, Vec3 w_o);

/// f_t1, 1/sr: scattered once and out below; 0 unless w_i is above and w_o below.
[[nodiscard]] double transmitted(const ThinLayer& layer, Vec3 w_i, Vec3 w_o);

/// T_0: the share that goes straight on, but for refraction. @param cos_i  mu_i, outside
[[nodiscard]] double unscattered(const ThinLayer& layer, double cos_i);

/// What becomes of light from one direction, as shares of it; their sum is at most 1.
struct LayerEnergy {
    double surface = 0;      ///< R = F, mirrored by the surface
    double reflected = 0;    ///< R_1, of f_r1 over the hemisphere above
    double transmitted = 0;  ///< T_1, of f_t1 over the hemisphere below
    double unscattered = 0;  ///< T_0
};

/// By quadrature, exact over the azimuth; to 1e-5 for |g| <= 0.9. @pre 0 < cos_i <= 1
[[nodiscard]] LayerEnergy layer_energy(const ThinLayer& layer, double cos_i);

/// R_1 and T_1 over the cosine of the light, tabulated once. Within 1e-3 of layer_energy() for
/// eta >= 1.3, and of 5e-3 without a boundary, where all happens in grazing light (tau >= 0.01).
class LayerTable {
public:
    explicit LayerTable(const ThinLayer& layer);

    /// @pre 0 <= cos_i <= 1
    [[nodiscard]] double reflected(double cos_i) const { return at(reflected_, cos_i); }
    [[nodiscard]] double transmitted(double cos_i) const { return at(transmitted_, cos_i); }

private:
    static constexpr int steps = 64;  // even ones of sqrt(cos_i): most changes near grazing light
    using Column = std::array<double, steps + 1>;

    static double at(const Column& column, double cos_i);

    Column reflected_;
    Column transmitted_;
};

/// A layer of skin, by the literature that HK93 takes it from.
struct LayerPreset {
    std::string_view name;
    Coefficients coefficients;  ///< 1/mm
    double thinnest = 0;        ///< mm
    double thickest = 0;        ///< mm
};

/// "epidermis" and "dermis"; the index is stated as 1.37 to 1.5, 1.4 is taken.
[[nodiscard]] std::span<const LayerPreset> layer_presets();

}  // namespace relit::scatter

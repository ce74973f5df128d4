// Subsurface scattering that knows where the light came from: two ray sources instead of two
// points, one along the refracted ray and its mirror image. For materials whose lit side glows
// away from the light.
//
// Two steps: directional_dipole() derives what a medium says, once per colour; ray_pair() what two
// points of the surface say, once for all colours; diffused() puts them together with two
// exponentials.
//
// Not reciprocal, and not energy conserving on a half space: 1.02 of marble's red light comes back,
// and of skin's green 1.7 times what the standard dipole gives. Frisvad, Hachisuka, Kjeldsen 2014, "Directional dipole model for
// subsurface scattering" (equations by the specification "translucency", section 3).
#pragma once

#include "core/base/vec.h"
#include "core/scatter/medium.h"

namespace relit::scatter {

enum class DirectionalEnergy {
    published,
    matched,  ///< scaled to what the better dipole gives for light at normal incidence
};

struct DirectionalOptions {
    /// d_r is at least 0.5/(3 sigma_t): no spikes where light grazes a rough surface. Changes
    /// nothing on flat surfaces with eta >= 1.16. On for pictures, off to compare with the paper.
    bool robust = false;
    DirectionalEnergy energy = DirectionalEnergy::published;
};

/// One colour of a medium, ready to be evaluated. Lengths in the unit of the coefficients.
struct DirectionalDipole {
    double diffusion = 0;      ///< D
    double sigma_tr = 0;       ///< s
    double extrapolation = 0;  ///< d_e
    double mirrored = 0;       ///< 2 A d_e, from the entry to the virtual source
    double edge_step = 0;      ///< 1/(3 sigma_t), what d_r adds where the exit is not front-lit
    double nearest = 0;        ///< d_r is at least this
    double touching = 0;       ///< 1e-9 l'; points nearer than this are one
    double c_phi = 0;          ///< C_phi(eta)
    double c_e = 0;            ///< C_E(eta)
    double norm = 0;           ///< 1/(4 C_phi(1/eta) 4 pi^2), times what matches the energy
    double eta = 1;
};

/// A medium that scatters nothing is taken to have an albedo of 1e-8: d_e stays finite.
[[nodiscard]] DirectionalDipole directional_dipole(const Coefficients& coefficients,
                                                   const DirectionalOptions& options = {});

struct SurfacePoint {
    Vec3 position;
    Vec3 normal;  ///< unit, outward
};

/// What the points x_i, x_o and the refracted direction say of the ray sources, as numbers.
struct RayPair {
    double squared_distance = 0;  ///< r^2, x = x_o - x_i
    double along = 0;             ///< x . w_12
    double outward = 0;           ///< x . n_o
    double facing = 0;            ///< w_12 . n_o = -mu0
    double down = 0;              ///< w_12 . n*, n* the normal of the modified tangent plane
    double agreement = 0;         ///< n* . n_o
};

/// @param inward    w_12, unit (refracted(), fresnel.h)
/// @param touching  points nearer than this are one; DirectionalDipole has it
[[nodiscard]] RayPair ray_pair(const SurfacePoint& entry, Vec3 inward, const SurfacePoint& exit,
                               double touching);

/// S'(x, w, d), of one ray source: light that leaves per area and solid angle.
/// @param along    x . w
/// @param facing   w . n_o
/// @param outward  x . n_o
/// @param d        > 0, corrected distance; not |x| on purpose
[[nodiscard]] double ray_source(const DirectionalDipole& dipole, double along, double facing,
                                double outward, double d);

struct Diffused {
    double s_d = 0;  ///< S_d, which may be negative; 0 where sigma_tr r > 80
    double d_r = 0;  ///< corrected distance of the real source
    double d_v = 0;  ///< distance of the virtual one
};

/// Finite for every pair.
[[nodiscard]] Diffused diffused(const DirectionalDipole& dipole, const RayPair& pair);

/// S = T(cos_i) max(0, S_d) T(cos_o): exit is normalised already. 0 from or to behind the surface.
/// @param to_light, to_viewer  unit vectors
[[nodiscard]] double bssrdf(const DirectionalDipole& dipole, const SurfacePoint& entry,
                            Vec3 to_light, const SurfacePoint& exit, Vec3 to_viewer);

/// The mean of S and S with entry and exit exchanged, which FHK14 suggest: reciprocal.
[[nodiscard]] double symmetric_bssrdf(const DirectionalDipole& dipole, const SurfacePoint& entry,
                                      Vec3 to_light, const SurfacePoint& exit, Vec3 to_viewer);

/// What a half space sends back of light that entered at normal incidence: pi F_dt times the
/// integral of max(0, S_d) over the plane, to 1e-6. More than 1 for white media as published.
[[nodiscard]] double half_space_total(const DirectionalDipole& dipole);

}  // namespace relit::scatter

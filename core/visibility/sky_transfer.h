// What of the light of the whole sky arrives at every texel of a map: d towards all directions at
// once, projected on a few smooth functions of the direction (hemisphere.h). Made once per map and
// solid; after that any sky far away costs a few products per texel. For render/.
//
// Sources: Sloan and others 2002, "Precomputed radiance transfer"; the march behind it is in
// kernels/band_march.h.
#pragma once

#include <stop_token>

#include "core/base/hemisphere.h"
#include "core/base/parallel.h"
#include "core/base/rect.h"
#include "core/base/simd.h"
#include "core/field/solid.h"
#include "core/image/colour.h"
#include "core/visibility/kernels/bands.h"

namespace relit {

/// How rays start and what becomes of their length inside: section 2 of the model.
struct SkyRays {
    double relief = 0;         ///< the solid's
    double depth = 0;          ///< t, scene units, > 0
    bool along_normal = true;  ///< p' lies along the normal, or else the view vector
    bool exponential = false;  ///< exp(-attenuation max(0, r - t)), or else min(1, t / r)
    double attenuation = 0;    ///< 1/scene unit
};

/// Directions that d is asked for: `azimuths` x `elevations` for each half of the sphere.
struct SkyDirections {
    int azimuths = 64;    ///< a multiple of 4, at most 128
    int elevations = 16;  ///< a multiple of 4, at most 16
};

/// A sky as functions of the direction: the sum over its lights of radiance times the functions'
/// values there, per colour.
struct SkyWeights {
    std::vector<Rgb> upper, lower;  ///< hemisphere::functions each; lower: at z negated, or empty

    explicit SkyWeights(bool has_lower_half);
    void add(Vec3 to_light, Rgb radiance);
};

/// The same in whole numbers; see SkyTransfer::light().
struct StoredSky {
    std::vector<short> weights;
    double scale[3] = {0, 0, 0};
};

class SkyTransfer {
public:
    /// By how much the surface bends from texel to texel, in texels, in the mean along the rows:
    /// 0.1 to 0.6 on scans and terrain, tens on noise.
    [[nodiscard]] static double roughness(const Solid& solid);
    /// The roughest that the smoothed march is within its bounds for.
    static constexpr double max_roughness = 1;

    /// Whether the 16-bit march can do a solid: its heights are fine enough beside the depth, and
    /// no floor lies above a start. What it gives of a rough one is out of bounds all the same.
    [[nodiscard]] static bool covers(const Solid& solid, double depth);

    /// Of the texels of `part`. Each one's numbers are the same with any part, executor and Simd.
    /// Takes about 0.5 microseconds per texel and thread with AVX-512.
    /// @pre covers(solid, rays.depth); `part` lies on the map (asserted)
    /// @throws Error cancelled
    SkyTransfer(const HeightField& field, const Solid& solid, const SkyRays& rays,
                SkyDirections directions, Rect part, const Executor& executor,
                const std::stop_token& stop, Simd simd);

    /// Whether light from below is part of it: not where the ground is endless.
    [[nodiscard]] bool has_lower_half() const { return halves_ == 2; }

    [[nodiscard]] StoredSky stored(const SkyWeights& sky) const;

    static constexpr int block_texels = kernels::block_texels;
    /// Sum of radiance times d over the sky's lights, for the texels of row j from column
    /// part.x + block_texels * block on, colour after colour; those beyond the part are undefined.
    void light(const StoredSky& sky, int block, int j, float (&out)[3][block_texels]) const;

    [[nodiscard]] Rect part() const { return part_; }
    [[nodiscard]] std::uint64_t bytes() const { return numbers_.size() * sizeof(short); }

private:
    [[nodiscard]] int pairs() const { return (halves_ * hemisphere::functions + 1) / 2; }
    [[nodiscard]] std::size_t place_of(int block, int j) const;

    Rect part_;
    int halves_, blocks_across_;
    kernels::LightBlock* light_block_;
    std::vector<short> numbers_;
};

}  // namespace relit

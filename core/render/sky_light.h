// An environment at infinity as one light: sums over its texels that are products with what is known
// of every texel of the map (SkyTransfer), and highlights from a table. For the shader. Source:
// integrated model, sections 5 and 6.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/base/rect.h"
#include "core/render/prepared.h"

namespace relit {

/// A colour by normal: a grid over the normal's x and y, on which mirrored views lie evenly (it is
/// their equal-area map).
class NormalTable {
public:
    /// @param size  grid points from -1 to 1, at least 2
    /// @param colour_of  of a unit normal, z >= 0; called from the executor's threads
    /// @throws Error cancelled
    NormalTable(int size, const std::function<Rgb(Vec3)>& colour_of, const RenderControl& control);

    /// Bilinear. @param normal  unit, z >= 0
    [[nodiscard]] Rgb at(Vec3 normal) const;

private:
    int size_;
    std::vector<Rgb> colours_;
};

class SkyLight {
public:
    /// Whether a light of a scene can be had in this way. What cannot: an environment of so few
    /// texels that their full sum is asked for, which is then exact; one on a sphere of finite
    /// radius, where d depends on more than the direction; `count`, which needs such a radius;
    /// highlights that d occludes, where the product of s and d is sharper than the functions that
    /// d is projected on; a floor above the starts of rays, a relief of more than 600 depths, and
    /// noise, where means of heights say little.
    [[nodiscard]] static bool covers(const Scene& scene, const Light& light,
                                     const PreparedSolid& prepared);

    /// Whether the relief of a scene is noise to it, told without preparing anything for rays.
    [[nodiscard]] static bool is_noise(const Scene& scene);

    /// What is summed: what the light adds to a colour, or its weights, for the layers of data.
    enum class Sum { colours, weights };

    /// Of the texels of `part`. @pre covers(). @throws Error cancelled
    /// @param has_diffuse  false: diffuse() is not asked for
    SkyLight(const Scene& scene, const EnvironmentLight& light, const PreparedSolid& prepared,
             Sum sum, bool has_diffuse, Rect part, bool preview, const RenderControl& control);

    /// Lights so small and strong that their shadows are sharper than diffuse() can show: their share
    /// of it is left to whoever sends rays. Only of colours.
    [[nodiscard]] const std::vector<LightSample>& suns() const { return suns_; }

    /// Directions that its d is made of where they are fewer than for a final picture, else 0.
    [[nodiscard]] int coarse_directions() const { return coarse_directions_; }

    /// Sum over the light without its suns of radiance times d; of colours also times (1 - k_f) + k_f f.
    [[nodiscard]] std::vector<Rgb> diffuse(std::span<const TexelIndex> texels) const;

    /// The same for `count` neighbours of row j from column i on, added to `sums`: so many numbers of each
    /// colour.
    void add_diffuse(int i, int j, int count, float* const (&sums)[3]) const;

    /// Sum of radiance times s.
    [[nodiscard]] Rgb highlight(Vec3 normal) const { return highlights_->at(normal); }

    /// Sum of radiance times f.
    [[nodiscard]] Rgb scatter() const { return scatter_; }

private:
    void prepare_diffuse(const Scene& scene, const Solid& solid,
                         const std::vector<LightSample>& samples, double scattered, Rect part,
                         bool preview, const RenderControl& control);

    std::shared_ptr<const SkyTransfer> transfer_;
    int coarse_directions_ = 0;
    std::vector<LightSample> suns_;
    StoredSky sky_;
    std::unique_ptr<const NormalTable> highlights_;
    Rgb scatter_;
};

/// One per light of a scene, null for those that are not had in this way.
using SkyLights = std::vector<std::unique_ptr<const SkyLight>>;

}  // namespace relit

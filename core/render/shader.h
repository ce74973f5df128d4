// The integrated model at texels: everything of a scene that is the same for all of them, prepared
// once, and a function per layer; those that need visibility take many texels at a time. For render(). Source: integrated model, sections 2, 4, 5
// and 9; the numbers below are its section 5.
#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include "core/base/rect.h"
#include "core/render/prepared.h"
#include "core/render/ray_tile.h"
#include "core/render/scene_lights.h"
#include "core/render/translucent_light.h"

namespace relit {

/// Prepared from a scene, which must outlive it. Its functions may be called from any thread.
///
/// Texels come in lists of one square of the map: 16 x 16, counted from the map's corner; fastest
/// with the whole square, row by row. A texel's numbers are the same in any list. The last parameter
/// takes them, one per texel, of colours and vectors three. Where `stop` is set they are unfinished.
class Shader {
public:
    /// @param skies  in place of the samples of some lights: one per light, null where there is none
    /// @param prepared  prepared_solid() of the scene; null: it is asked for here
    /// @param translucent  translucent_light() of the scene and the layer that is asked for; null: of
    ///                     another layer than it is for
    Shader(const Scene& scene, Transfer transfer, EnvironmentSampling sampling,
           const RenderControl& control, SkyLights skies = {},
           std::shared_ptr<const PreparedSolid> prepared = nullptr,
           const TranslucentLight* translucent = nullptr);

    /// Whether beauty() and illumination() send rays out.
    [[nodiscard]] bool sends_rays() const {
        return !lights_.samples.empty() || !lights_.suns.empty();
    }
    /// Whether beauty_row() does what beauty() does.
    [[nodiscard]] bool shades_rows() const { return !sends_rays() && !is_translucent(); }

    /// c of section 5: (1 - k_s) c_B + sum over lights of w E. All reds first, then greens, blues.
    void beauty(std::span<const TexelIndex> texels, const std::stop_token& stop,
                std::span<float> rgb) const;
    /// The same for `count` texels of row j from column i on, three numbers a texel. @pre shades_rows()
    void beauty_row(int i, int j, int count, std::span<float> rgb) const;
    /// Weighted mean of d over the first light's samples.
    void illumination(std::span<const TexelIndex> texels, const std::stop_token& stop,
                      std::span<float> d) const;
    /// r of the first light in scene units; infinity where it is endless. @pre one sample
    void thickness(std::span<const TexelIndex> texels, std::span<float> r) const;
    /// Weighted mean of s over the first light's samples.
    void specular(std::span<const TexelIndex> texels, std::span<float> s) const;
    /// Weighted mean of f over the first light's samples.
    void scatter(std::span<const TexelIndex> texels, std::span<float> f) const;
    /// The layer of TranslucentLight. All reds first, then greens, blues.
    void surface_layer(std::span<const TexelIndex> texels, std::span<float> rgb) const;
    /// Unit normal with normalScale. All x first, then y, z.
    void normal(std::span<const TexelIndex> texels, std::span<float> xyz) const;

private:
    [[nodiscard]] bool is_translucent() const { return scene_.material.is_translucent(); }
    struct Mirrored;
    [[nodiscard]] Vec3 start(TexelIndex at) const;  // p'
    [[nodiscard]] Vec3 normal(TexelIndex at) const;
    void add_skies(std::span<const TexelIndex> texels, bool is_glossy, TileSums& diffuse,
                   TileSums& glossy) const;
    [[nodiscard]] RayTile starts(std::span<const TexelIndex> texels) const;
    void prefetch_next(TexelIndex at) const;
    void sink(std::span<const TexelIndex> texels, RayTile& tile) const;
    void illuminate(const LightSample& sample, std::span<const TexelIndex> texels,
                    const RayTile& tile, std::span<float> d) const;
    void fill_matt_share(const LightSample& sample, const RayTile& tile,
                         std::span<float> share) const;
    template <class Add>
    void for_each_highlight(const LightSample& sample, const RayTile& tile,
                            const Mirrored& mirrored, const Add& add) const;

    const Scene& scene_;
    const HeightField& field_;
    std::shared_ptr<const PreparedSolid> prepared_;
    const Solid& solid_;
    const PacketSolid& packets_;
    const TranslucentLight* translucent_;
    SceneLights lights_;
    Rgb base_, diffuse_, specular_;
};

}  // namespace relit

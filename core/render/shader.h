// The integrated model at texels: everything of a scene that is the same for all of them, prepared
// once, and a function per layer; those that need visibility take many texels at a time. For render(). Source: integrated model, sections 2, 4, 5
// and 9; the numbers below are its section 5.
#pragma once

#include <algorithm>
#include <limits>
#include <span>
#include <stop_token>
#include <vector>

#include "core/base/rect.h"
#include "core/render/prepared.h"
#include "core/render/sky_light.h"

namespace relit {

/// Prepared from a scene, which must outlive it. Its functions may be called from any thread.
///
/// Texels come in lists, best those of a tile of 16 x 16; a texel's numbers are the same in any list.
/// Where `stop` is set the numbers are unfinished.
class Shader {
public:
    /// @param skies  in place of the samples of some lights: one per light, null where there is none
    Shader(const Scene& scene, Transfer transfer, EnvironmentSampling sampling,
           const RenderControl& control, SkyLights skies = {});

    /// Whether beauty() and illumination() send rays out; else lists along rows are the best.
    [[nodiscard]] bool sends_rays() const { return !samples_.empty(); }

    /// c of section 5: (1 - k_s) c_B + sum over lights of w E.
    [[nodiscard]] std::vector<Rgb> beauty(std::span<const TexelIndex> texels,
                                          const std::stop_token& stop = {}) const;
    /// The same for `count` texels of row j from column i on. @pre no rays are sent
    void beauty_row(int i, int j, int count, float* out) const;
    /// Weighted mean of d over the first light's samples.
    [[nodiscard]] std::vector<double> illumination(std::span<const TexelIndex> texels,
                                                   const std::stop_token& stop = {}) const;
    /// r of the first light in scene units; infinity where it is endless. @pre one sample
    [[nodiscard]] std::vector<double> thickness(std::span<const TexelIndex> texels) const;
    /// Weighted means of s and f over the first light's samples.
    [[nodiscard]] double specular(TexelIndex at) const;
    [[nodiscard]] double scatter(TexelIndex at) const;
    /// Unit normal with normalScale.
    [[nodiscard]] Vec3 normal(TexelIndex at) const;

private:
    [[nodiscard]] Vec3 start(TexelIndex at) const;  // p'
    [[nodiscard]] std::vector<Vec3> starts(std::span<const TexelIndex> texels) const;
    void illuminate(const LightSample& sample, std::span<const Vec3> from,
                    std::span<double> d) const;
    [[nodiscard]] Rgb highlight(const LightSample& sample, Vec3 from,
                                Vec3 normal) const;  // s times radiance
    [[nodiscard]] Rgb albedo(TexelIndex at) const;
    template <class Add>
    void for_each_highlight(const LightSample& sample, Vec3 from, Vec3 normal,
                            const Add& add) const;

    const Scene& scene_;
    const HeightField& field_;
    std::shared_ptr<const PreparedSolid> prepared_;
    const Solid& solid_;
    const PacketSolid& packets_;
    std::vector<double> column_x_, row_y_;  // scene units of texel centres
    std::vector<LightSample> samples_;      // of all lights, in the scene's order
    std::size_t first_light_samples_;       // how many of them are the first light's
    SkyLights skies_;
    const SkyLight* first_sky_ = nullptr;  // the first light, if it is one
    Rgb base_, diffuse_, specular_;
};

/// The nearest float; what is beyond them all is the largest.
inline float stored_number(double value) {
    return float(std::min<double>(value, std::numeric_limits<float>::max()));
}

}  // namespace relit

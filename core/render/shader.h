// The integrated model at one texel: everything of a scene that is the same for all texels,
// prepared once, and a function per layer. For render(). Source: integrated model, sections 2, 4, 5
// and 9; the numbers below are its section 5.
#pragma once

#include <vector>

#include "core/render/scene.h"
#include "core/visibility/ray.h"

namespace relit {

/// Prepared from a scene, which must outlive it. Its functions may be called from any thread.
class Shader {
public:
    Shader(const Scene& scene, Transfer transfer, EnvironmentSampling sampling);

    /// c of section 5: (1 - k_s) c_B + sum over lights of w E.
    [[nodiscard]] Rgb beauty(int i, int j) const;
    /// Weighted mean of d over the first light's samples.
    [[nodiscard]] double illumination(int i, int j) const;
    /// r of the first light in scene units; infinity where it is endless. @pre one sample
    [[nodiscard]] double thickness(int i, int j) const;
    /// Weighted means of s and f over the first light's samples.
    [[nodiscard]] double specular(int i, int j) const;
    [[nodiscard]] double scatter(int i, int j) const;
    /// Unit normal with normalScale.
    [[nodiscard]] Vec3 normal(int i, int j) const;

private:
    // Where a texel's rays start, and its normal for highlights.
    struct Texel {
        Vec3 start;  // p'
        Vec3 normal;
    };
    [[nodiscard]] Texel texel(int i, int j) const;
    [[nodiscard]] double illumination(const LightSample& sample, const Ray& ray) const;
    [[nodiscard]] Rgb highlight(const LightSample& sample,
                                const Texel& at) const;  // s times radiance
    [[nodiscard]] Rgb albedo(int i, int j) const;
    template <class Add>
    void for_each_highlight(const LightSample& sample, const Texel& at, const Add& add) const;
    template <class Value>
    [[nodiscard]] double mean_over_first_light(const Value& value) const;

    const Scene& scene_;
    Solid solid_;
    std::vector<LightSample> samples_;  // of all lights, in the scene's order
    std::size_t first_light_samples_;   // how many of them are the first light's
    Rgb base_, diffuse_, specular_;
};

}  // namespace relit

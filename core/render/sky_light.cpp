#include "core/render/sky_light.h"

#include <algorithm>
#include <cmath>

#include "core/base/angle.h"
#include "core/render/ray_tile.h"
#include "core/shade/factors.h"

namespace relit {
namespace {

// Finer than a transfer can show; the parts are for highlights.
constexpr EnvironmentSampling sky_sampling{.max_texels = 512, .regions = 2048, .parts = 4};

Rgb interpolated(const Rgb* row, double a) { return (1 - a) * row[0] + a * row[1]; }

// Grid points from -1 to 1 that show the ramp in some ten steps.
int table_size(Falloff falloff) {
    const double width = std::acos(falloff.lo) - std::acos(falloff.hi);
    // A step of the grid turns the mirrored direction by 4 / size in the middle.
    return std::clamp(int(std::ceil(4 * 10 / width)), 24, 384) + 1;
}

double brightness(const LightSample& sample) { return luminance(sample.radiance); }

double brightness(const std::vector<LightSample>& samples) {
    double sum = 0;
    for (const LightSample& sample : samples) sum += brightness(sample);
    return sum;
}

// The samples within an angle of a direction, as one light.
LightSample merged(const std::vector<LightSample>& samples, Vec3 at, double cosine) {
    LightSample sum{.at = {}, .at_infinity = true, .radiance = {}, .weight = 0, .parts = {}};
    for (const LightSample& sample : samples) {
        if (dot(sample.at, at) < cosine) continue;
        sum.at = sum.at + brightness(sample) * sample.at;
        sum.radiance = sum.radiance + sample.radiance;
        sum.weight += sample.weight;
    }
    sum.at = normalized(sum.at);
    return sum;
}

// Takes the brightest spots out of the samples: those within a degree that hold a hundredth of all
// light or more, and are not a part of something larger, whose shadows are soft.
std::vector<LightSample> taken_suns(std::vector<LightSample>& samples) {
    constexpr int most = 8;
    constexpr double least_share = 0.01, least_contrast = 20, most_around = 3;
    const double spot = std::cos(radians(1.0)), around = std::cos(radians(6.0));
    const double all = brightness(samples);
    std::vector<LightSample> suns;
    while (int(suns.size()) < most) {
        const auto density = [](const LightSample& s) {
            return s.weight > 0 ? brightness(s) / s.weight : 0;
        };
        const auto brightest = std::max_element(
            samples.begin(), samples.end(),
            [&](const LightSample& a, const LightSample& b) { return density(a) < density(b); });
        if (brightest == samples.end() || density(*brightest) < least_contrast * all) break;
        const Vec3 at = brightest->at;
        const LightSample sun = merged(samples, at, spot);
        const double beside = brightness(merged(samples, at, around)) - brightness(sun);
        if (brightness(sun) < least_share * all || beside > most_around * brightness(sun)) break;
        suns.push_back(sun);
        std::erase_if(samples, [&](const LightSample& s) { return dot(s.at, at) >= spot; });
    }
    return suns;
}

// Sums of s times radiance by normal, s as specular_factor() has it, as fine as the falloff is sharp.
std::unique_ptr<const NormalTable> highlight_table(const std::vector<LightSample>& samples,
                                                   Falloff falloff, const RenderControl& control) {
    struct Part {
        float x, y, z, r, g, b;
    };
    std::vector<Part> parts;
    const auto add = [&](Vec3 at, Rgb c) {
        if (!(c == Rgb{}))
            parts.push_back(
                {float(at.x), float(at.y), float(at.z), float(c.r), float(c.g), float(c.b)});
    };
    for (const LightSample& sample : samples) {
        if (sample.parts.empty()) add(sample.at, sample.radiance);
        for (const SamplePart& part : sample.parts) add(part.at, part.radiance);
    }
    const float lo = float(falloff.lo), inverse = float(1 / (falloff.hi - falloff.lo));
    const auto sum_at = [&](Vec3 n) -> Rgb {
        const float mx = float(2 * n.z * n.x), my = float(2 * n.z * n.y),
                    mz = float(2 * n.z * n.z - 1);
        float r = 0, g = 0, b = 0;
        for (const Part& part : parts) {
            const float c = mx * part.x + my * part.y + mz * part.z;
            const float s = std::min(std::max((c - lo) * inverse, 0.0f), 1.0f);
            r += s * part.r;
            g += s * part.g;
            b += s * part.b;
        }
        return {r, g, b};
    };
    return std::make_unique<const NormalTable>(table_size(falloff), sum_at, control);
}

}  // namespace

NormalTable::NormalTable(int size, const std::function<Rgb(Vec3)>& colour_of,
                         const RenderControl& control)
    : size_(size), colours_(std::size_t(size) * size) {
    parallel_rows(control.executor, size_, control.stop, [&](RowRange rows) {
        for (int q = rows.begin; q < rows.end; ++q)
            for (int p = 0; p < size_; ++p) {
                double x = 2.0 * p / (size_ - 1) - 1, y = 2.0 * q / (size_ - 1) - 1;
                const double out = std::hypot(x, y);
                const double step = 2.0 / (size_ - 1);
                if (out > 1 + 2 * step) continue;  // no normal is near
                if (out > 1) x /= out, y /= out;
                const double z = std::sqrt(std::max(0.0, 1 - x * x - y * y));
                colours_[std::size_t(q) * size_ + p] = colour_of({x, y, z});
            }
    });
}

Rgb NormalTable::at(Vec3 normal) const {
    const double x = 0.5 * (normal.x + 1) * (size_ - 1), y = 0.5 * (normal.y + 1) * (size_ - 1);
    const int i = std::clamp(int(x), 0, size_ - 2), j = std::clamp(int(y), 0, size_ - 2);
    const Rgb* lower = &colours_[std::size_t(j) * size_ + i];
    return (1 - (y - j)) * interpolated(lower, x - i) +
           (y - j) * interpolated(lower + size_, x - i);
}

bool SkyLight::covers(const Scene& scene, const Light& light, const PreparedSolid& prepared) {
    const auto* environment = std::get_if<EnvironmentLight>(&light);
    const Material& m = scene.material;
    return environment && !environment->radius &&
           environment->map->texels() > std::size_t(final_environment.max_texels) &&
           m.illumination != Illumination::count && !(m.specular.k > 0 && m.specular.occlude) &&
           prepared.roughness <= SkyTransfer::max_roughness &&
           SkyTransfer::covers(prepared.solid, m.depth);
}

bool SkyLight::is_noise(const Scene& scene) {
    const Solid solid = make_solid(*scene.field, scene.relief, scene.base, scene.material.depth);
    return SkyTransfer::roughness(solid) > SkyTransfer::max_roughness;
}

SkyLight::SkyLight(const Scene& scene, const EnvironmentLight& light, const PreparedSolid& prepared,
                   Sum sum, bool has_diffuse, Rect part, bool preview,
                   const RenderControl& control) {
    const bool glossy = sum == Sum::weights || scene.material.specular.k > 0;
    std::vector<LightSample> samples = samples_of(
        light, {}, *shared_environment_lights(light, sky_sampling, control.cache), glossy);
    for (LightSample& sample : samples) {
        if (sum == Sum::weights) {
            sample.radiance = {sample.weight, sample.weight, sample.weight};
            for (SamplePart& p : sample.parts) p.radiance = {p.weight, p.weight, p.weight};
        }
        scatter_ =
            scatter_ + scatter_factor(sample.at, scene.material.scatter.falloff) * sample.radiance;
    }
    if (glossy) highlights_ = highlight_table(samples, scene.material.specular.falloff, control);
    if (sum == Sum::colours && has_diffuse) suns_ = taken_suns(samples);
    if (has_diffuse)
        prepare_diffuse(scene, prepared.solid, samples,
                        sum == Sum::colours ? scene.material.scatter.k : 0, part, preview, control);
}

void SkyLight::prepare_diffuse(const Scene& scene, const Solid& solid,
                               const std::vector<LightSample>& samples, double scattered, Rect part,
                               bool preview, const RenderControl& control) {
    const PreparedSky sky = prepared_sky(scene, solid, part, preview, control);
    transfer_ = sky.transfer;
    coarse_directions_ = sky.coarse ? preview_sky.azimuths * preview_sky.elevations : 0;
    SkyWeights weights(transfer_->has_lower_half());
    for (const LightSample& sample : samples) {
        const double f = scatter_factor(sample.at, scene.material.scatter.falloff);
        weights.add(sample.at, ((1 - scattered) + scattered * f) * sample.radiance);
    }
    sky_ = transfer_->stored(weights);
}

void SkyLight::add_diffuse(int i, int j, int count, float* const (&sums)[3]) const {
    constexpr int block_texels = SkyTransfer::block_texels;
    float lit[3][block_texels];
    const int first = i - transfer_->part().x;
    for (int k = 0; k < count;) {  // block by block, the first and last in part
        const int place = first + k, begin = place % block_texels;
        const int size = std::min(block_texels - begin, count - k);
        transfer_->light(sky_, place / block_texels, j, lit);
        for (int c = 0; c < 3; ++c)
            for (int n = 0; n < size; ++n) sums[c][k + n] += lit[c][begin + n];
        k += size;
    }
}

std::vector<Rgb> SkyLight::diffuse(std::span<const TexelIndex> texels) const {
    const std::size_t size = texels.size();
    std::vector<float> sums(3 * size);
    for_each_run(texels, [&](std::size_t k, std::size_t count, TexelIndex at) {
        add_diffuse(at.i, at.j, int(count), {&sums[k], &sums[size + k], &sums[2 * size + k]});
    });
    std::vector<Rgb> colours(size);
    for (std::size_t k = 0; k < size; ++k)
        colours[k] = {sums[k], sums[size + k], sums[2 * size + k]};
    return colours;
}

}  // namespace relit

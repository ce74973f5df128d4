#include "core/visibility/sky_transfer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "core/visibility/sky_rays.h"

namespace relit {
namespace {

using kernels::band_texels;

// No projection of a d in [0, 1] is larger: the functions are orthonormal, and a hemisphere has 2 pi.
const double largest = std::sqrt(2 * std::numbers::pi);
constexpr int short_max = 32767;

kernels::Bands* bands_of(Simd simd) {
    switch (simd) {
#if defined(__x86_64__)
        case Simd::avx512:
            return kernels::bands_avx512;
        case Simd::avx2:
            return kernels::bands_avx2;
#endif
        default:
            return kernels::bands_portable;
    }
}

kernels::LightBlock* light_block_of(Simd simd) {
    switch (simd) {
#if defined(__x86_64__)
        case Simd::avx512:
            return kernels::light_block_avx512;
        case Simd::avx2:
            return kernels::light_block_avx2;
#endif
        default:
            return kernels::light_block_portable;
    }
}

short stored_number(float projection) {
    const float number = std::floor(projection * float(short_max / largest) + 0.5f);
    return short(std::clamp(number, -float(short_max), float(short_max)));
}

}  // namespace

SkyWeights::SkyWeights(bool has_lower_half)
    : upper(hemisphere::functions), lower(has_lower_half ? hemisphere::functions : 0) {}

void SkyWeights::add(Vec3 to_light, Rgb radiance) {
    std::vector<Rgb>& half = to_light.z >= 0 ? upper : lower;
    if (half.empty()) return;
    const auto values = hemisphere::values({to_light.x, to_light.y, std::abs(to_light.z)});
    for (int f = 0; f < hemisphere::functions; ++f) half[f] = half[f] + values[f] * radiance;
}

double SkyTransfer::roughness(const Solid& solid) {
    double sum = 0;
    for (int v = 1; v <= solid.height; ++v) {
        const float* row = solid.z.row(v);
        float of_row = 0;
        for (int u = 1; u <= solid.width; ++u)
            of_row += std::abs((row[u - 1] - row[u]) + (row[u + 1] - row[u]));
        sum += of_row;
    }
    return sum / solid.height;  // a mean in texels: times the width, divided by it
}

bool SkyTransfer::covers(const Solid& solid, double depth) {
    const double lowest = solid.endless_ground ? 0 : std::min(0.0, solid.floor_z);
    const double range = std::max(solid.top_z, 0.0) - lowest + 2 * depth;
    return (solid.endless_ground || solid.floor_z <= -depth) && range / 65532 <= depth / 100;
}

SkyTransfer::SkyTransfer(const HeightField& field, const Solid& solid, const SkyRays& rays,
                         SkyDirections directions, Rect part, const Executor& executor,
                         const std::stop_token& stop, Simd simd)
    : part_(part),
      halves_(solid.endless_ground ? 1 : 2),
      blocks_across_((part.width + band_texels - 1) / band_texels * (band_texels / block_texels)),
      light_block_(light_block_of(simd)),
      numbers_(place_of(0, part.y + part.height)) {
    assert(covers(solid, rays.depth) && part.x >= 0 && part.y >= 0 &&
           part.x + part.width <= solid.width && part.y + part.height <= solid.height);
    const SkyMarch march(field, solid, rays, directions, executor);
    kernels::Bands* const bands = bands_of(simd);
    const int functions = halves_ * hemisphere::functions;
    parallel_rows(executor, part.height, stop, [&](RowRange rows) {
        std::vector<float> projected(std::size_t(functions) * band_texels);
        for (int j = part.y + rows.begin; j < part.y + rows.end; ++j)
            for (int i = 0; i < part.width; i += band_texels) {
                const auto packet = march.packet(part.x + i, j, part.x + part.width);
                if (!packet) continue;  // all masked: 0
                bands(march.scenery(), *packet, projected.data());
                for (int k = 0; k < band_texels; ++k) {
                    short* to = &numbers_[place_of((i + k) / block_texels, j)];
                    for (int f = 0; f < functions; ++f)
                        to[(f / 2 * block_texels + k % block_texels) * 2 + f % 2] =
                            stored_number(projected[std::size_t(f) * band_texels + k]);
                }
            }
    });
}

std::size_t SkyTransfer::place_of(int block, int j) const {
    return (std::size_t(j - part_.y) * blocks_across_ + block) * pairs() * (2 * block_texels);
}

// Weights are scaled so that their squares sum to no more than 2^30; so do those of a projection,
// and no sum of products is beyond an int (Cauchy and Schwarz).
StoredSky SkyTransfer::stored(const SkyWeights& sky) const {
    StoredSky result;
    result.weights.resize(std::size_t(pairs()) * 6);
    double Rgb::*const colours[] = {&Rgb::r, &Rgb::g, &Rgb::b};
    for (int c = 0; c < 3; ++c) {
        double squares = 0;
        for (const auto* half : {&sky.upper, &sky.lower})
            for (const Rgb& w : *half) squares += w.*colours[c] * w.*colours[c];
        if (squares == 0) continue;
        const double scale = (short_max - 64) / std::sqrt(squares);
        int f = 0;
        for (const auto* half : {&sky.upper, &sky.lower})
            for (const Rgb& w : *half) {
                result.weights[(f / 2 * 3 + c) * 2 + f % 2] =
                    short(std::lround(scale * w.*colours[c]));
                ++f;
            }
        result.scale[c] = largest / short_max / scale;
    }
    return result;
}

void SkyTransfer::light(const StoredSky& sky, int block, int j,
                        float (&out)[3][block_texels]) const {
    int sums[3 * block_texels];
    light_block_(&numbers_[place_of(block, j)], pairs(), sky.weights.data(), sums);
    for (int c = 0; c < 3; ++c)
        for (int k = 0; k < block_texels; ++k)
            out[c][k] = std::max(0.0f, float(sums[c * block_texels + k]) * float(sky.scale[c]));
}

}  // namespace relit

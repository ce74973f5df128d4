#include "core/transport/texel_tree.h"

#include <algorithm>
#include <array>

#include "core/transport/tree_sum.h"

namespace relit {
namespace {

// Texels whose sums are made together: a square.
constexpr int square_side = 8;
static_assert(square_side * square_side == kernels::group_points);

constexpr std::uint32_t no_place = 0xffffffff;

SurfaceSamples samples_of(const TransportSurface& surface, std::vector<std::uint32_t>& texels) {
    SurfaceSamples samples;
    const double spacing = surface.spacing();
    for (int j = 0; j < surface.height(); ++j)
        for (int i = 0; i < surface.width(); ++i) {
            if (!(surface.area.at(i, j) > 0)) continue;
            texels.push_back(std::uint32_t(j) * surface.width() + i);
            samples.x.push_back(float((i + 0.5) * spacing));
            samples.y.push_back(float((j + 0.5) * spacing));
            samples.z.push_back(surface.z.at(i, j));
            samples.area.push_back(surface.area.at(i, j));
        }
    return samples;
}

}  // namespace

TexelTree::TexelTree(const TransportSurface& surface, const std::stop_token& stop, Simd simd)
    : simd_(simd),
      place_(surface.area.values.size(), no_place),
      tree_(samples_of(surface, texels_), stop) {
    for (std::size_t k = 0; k < texels_.size(); ++k)
        place_[texels_[tree_.order()[k]]] = std::uint32_t(k);
}

std::uint64_t TexelTree::bytes() const {
    return tree_.bytes() + (texels_.size() + place_.size()) * sizeof(std::uint32_t);
}

Image TexelTree::sum(const RadialKernel& kernel, float threshold, const Image& flux,
                     const Executor& executor, const std::stop_token& stop) const {
    const int channels = flux.channels;
    std::vector<float> of_samples;
    of_samples.reserve(texels_.size() * std::size_t(channels));
    for (const std::uint32_t texel : texels_)
        for (int c = 0; c < channels; ++c)
            of_samples.push_back(flux.values[std::size_t(texel) * channels + c]);
    const TreeFlux in_tree = tree_flux(tree_, of_samples, channels);
    const TreeSum tree_sum(tree_, in_tree, kernel, threshold, simd_);
    Image out(flux.width, flux.height, channels);

    const auto sum_square = [&](int left, int top, TreeSum::Lists& lists) {
        std::array<std::size_t, kernels::group_points> texels;
        kernels::PointGroup points;
        int count = 0;
        const auto add = [&](std::size_t texel) {
            const SurfaceSamples& samples = tree_.samples();
            const std::uint32_t from = place_[texel];
            points.x[count] = samples.x[from];
            points.y[count] = samples.y[from];
            points.z[count] = samples.z[from];
            texels[count++] = texel;
        };
        for (int j = top; j < std::min(top + square_side, flux.height); ++j)
            for (int i = left; i < std::min(left + square_side, flux.width); ++i)
                if (const std::size_t texel = std::size_t(j) * flux.width + i;
                    place_[texel] != no_place)
                    add(texel);
        if (count == 0) return;
        const int present = count;
        while (count < kernels::group_points) add(texels[0]);
        std::array<float, RadialKernel::max_channels * kernels::group_points> sums;
        tree_sum(points, lists, sums);
        for (int k = 0; k < present; ++k)
            for (int c = 0; c < channels; ++c)
                out.values[texels[k] * channels + c] = sums[c * kernels::group_points + k];
    };
    const int bands = (flux.height + square_side - 1) / square_side;
    parallel_rows(executor, bands, stop, [&](RowRange rows) {
        TreeSum::Lists lists;
        for (int band = rows.begin; band < rows.end; ++band)
            for (int i = 0; i < flux.width; i += square_side)
                sum_square(i, band * square_side, lists);
    });
    return out;
}

}  // namespace relit

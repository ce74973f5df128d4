#include "core/transport/transport.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "core/transport/sample_tree.h"
#include "core/transport/tree_sum.h"

namespace relit {
namespace {

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

float threshold_of(TransportAccuracy accuracy) {
    switch (accuracy) {
        case TransportAccuracy::preview:
            return 0.3f;
        case TransportAccuracy::final:
            return 0.05f;
        case TransportAccuracy::exact:
            break;
    }
    return 0.02f;
}

// Texels whose sums are made together: a square.
constexpr int square_side = 8;
static_assert(square_side * square_side == kernels::group_points);

}  // namespace

std::string_view name_of(TransportPath path) {
    switch (path) {
        case TransportPath::convolution:
            return "convolution";
        case TransportPath::levels:
            return "levels";
        case TransportPath::tree:
            return "tree";
    }
    return {};
}

struct Transport::Parts {
    std::shared_ptr<const TransportSurface> surface;
    std::shared_ptr<const RadialKernel> kernel;
    float threshold = 0;
    Simd simd;
    std::vector<std::uint32_t> texels;  // of the samples
    SampleTree tree;

    Parts(std::shared_ptr<const TransportSurface> s, std::shared_ptr<const RadialKernel> k,
          TransportAccuracy accuracy, const std::stop_token& stop, Simd with)
        : surface(std::move(s)),
          kernel(std::move(k)),
          threshold(threshold_of(accuracy)),
          simd(with),
          tree(samples_of(*surface, texels), stop) {}
};

namespace {

// The sums of the texels of the square at (left, top).
void sum_square(const TransportSurface& surface, const RadialKernel& kernel,
                const TreeSum& tree_sum, const Image& flux, int left, int top,
                TreeSum::Lists& lists, Image& out) {
    struct Texel {
        int i, j;
    };
    std::array<Texel, kernels::group_points> texels;
    kernels::PointGroup points;
    int count = 0;
    for (int j = top; j < std::min(top + square_side, flux.height); ++j)
        for (int i = left; i < std::min(left + square_side, flux.width); ++i) {
            if (!(surface.area.at(i, j) > 0)) continue;
            points.x[count] = float((i + 0.5) * surface.spacing());
            points.y[count] = float((j + 0.5) * surface.spacing());
            points.z[count] = surface.z.at(i, j);
            texels[count++] = {i, j};
        }
    if (count == 0) return;
    for (int k = count; k < kernels::group_points; ++k) {
        points.x[k] = points.x[0];
        points.y[k] = points.y[0];
        points.z[k] = points.z[0];
    }
    std::array<float, RadialKernel::max_channels * kernels::group_points> sums;
    tree_sum(points, lists, sums);
    for (int k = 0; k < count; ++k) {
        const auto [i, j] = texels[k];
        for (int c = 0; c < flux.channels; ++c)
            out.at(i, j, c) =
                sums[c * kernels::group_points + k] +
                float(kernel.at_own_place(c, surface.area.at(i, j))) * flux.at(i, j, c);
    }
}

}  // namespace

Transport::Transport(std::shared_ptr<const TransportSurface> surface,
                     std::shared_ptr<const RadialKernel> kernel, TransportAccuracy accuracy,
                     const Executor&, const std::stop_token& stop, Simd simd)
    : parts_(std::make_unique<Parts>(std::move(surface), std::move(kernel), accuracy, stop, simd)) {
}

Transport::~Transport() = default;

TransportPath Transport::path() const { return TransportPath::tree; }

std::uint64_t Transport::bytes() const {
    return parts_->tree.bytes() + parts_->texels.size() * sizeof(std::uint32_t);
}

Image Transport::sum(const Image& flux, const Executor& executor,
                     const std::stop_token& stop) const {
    const TransportSurface& surface = *parts_->surface;
    const RadialKernel& kernel = *parts_->kernel;
    const int channels = kernel.channels();
    assert(flux.width == surface.width() && flux.height == surface.height());
    assert(flux.channels == channels);
    std::vector<float> of_samples;
    for (const std::uint32_t texel : parts_->texels)
        for (int c = 0; c < channels; ++c)
            of_samples.push_back(flux.values[std::size_t(texel) * channels + c]);
    const TreeFlux in_tree = tree_flux(parts_->tree, of_samples, channels);
    const TreeSum tree_sum(parts_->tree, in_tree, kernel, parts_->threshold, parts_->simd);
    Image out(flux.width, flux.height, channels);
    const int bands = (flux.height + square_side - 1) / square_side;
    parallel_rows(executor, bands, stop, [&](RowRange rows) {
        TreeSum::Lists lists;
        for (int band = rows.begin; band < rows.end; ++band)
            for (int i = 0; i < flux.width; i += square_side)
                sum_square(surface, kernel, tree_sum, flux, i, band * square_side, lists, out);
    });
    return out;
}

Image transported(const TransportSurface& surface, const Image& flux, const RadialKernel& kernel,
                  TransportAccuracy accuracy, const Executor& executor,
                  const std::stop_token& stop) {
    // Borrowed for the call.
    const std::shared_ptr<const TransportSurface> s(std::shared_ptr<void>(), &surface);
    const std::shared_ptr<const RadialKernel> k(std::shared_ptr<void>(), &kernel);
    return Transport(s, k, accuracy, executor, stop).sum(flux, executor, stop);
}

}  // namespace relit

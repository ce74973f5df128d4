#include "core/transport/transport.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/transport/sample_tree.h"

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

}  // namespace

double TransportSurface::extent() const {
    const auto [low, high] = std::minmax_element(z.values.begin(), z.values.end());
    return std::hypot(1.0, spacing() * height(), double(*high) - *low);
}

std::string_view name_of(TransportPath path) {
    switch (path) {
        case TransportPath::convolution:
            return "convolution";
        case TransportPath::tree:
            return "tree";
    }
    return {};
}

struct Transport::Parts {
    std::shared_ptr<const TransportSurface> surface;
    std::shared_ptr<const RadialKernel> kernel;
    float threshold = 0;
    std::vector<std::uint32_t> texels;  // of the samples
    SampleTree tree;

    Parts(std::shared_ptr<const TransportSurface> s, std::shared_ptr<const RadialKernel> k,
          TransportAccuracy accuracy, const std::stop_token& stop)
        : surface(std::move(s)),
          kernel(std::move(k)),
          threshold(threshold_of(accuracy)),
          tree(samples_of(*surface, texels), stop) {}
};

Transport::Transport(std::shared_ptr<const TransportSurface> surface,
                     std::shared_ptr<const RadialKernel> kernel, TransportAccuracy accuracy,
                     const Executor&, const std::stop_token& stop, Simd)
    : parts_(std::make_unique<Parts>(std::move(surface), std::move(kernel), accuracy, stop)) {}

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
    Image out(flux.width, flux.height, channels);
    parallel_rows(executor, flux.height, stop, [&](RowRange rows) {
        for (int j = rows.begin; j < rows.end; ++j)
            for (int i = 0; i < flux.width; ++i) {
                const float area = surface.area.at(i, j);
                if (!(area > 0)) continue;
                const float point[3] = {float((i + 0.5) * surface.spacing()),
                                        float((j + 0.5) * surface.spacing()), surface.z.at(i, j)};
                float* sum = &out.at(i, j);
                tree_sum(parts_->tree, in_tree, kernel, parts_->threshold, point, sum);
                for (int c = 0; c < channels; ++c)
                    sum[c] += float(kernel.at_own_place(c, area)) * flux.at(i, j, c);
            }
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

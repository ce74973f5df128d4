#include "core/transport/transport.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/transport/convolution.h"
#include "core/transport/level_sum.h"
#include "core/transport/texel_tree.h"

namespace relit {

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

namespace {

// What one accuracy asks for. Errors are relative, RMS, of M; measured in tests and benchmarks.
struct Demands {
    double steepness;      // mean square of slopes that distances along the plane will do for
    double ratio;          // LevelSum's
    double nodes_to_core;  // of its first level
    double cliffs;         // that it may have as one sheet
    int sheets;            // otherwise
    double sheets_cliffs;  // and then
    float threshold;       // of the tree
};

Demands demands_of(TransportAccuracy accuracy) {
    switch (accuracy) {
        case TransportAccuracy::preview:
            return {0.01, 3, 1.1, 0.005, 2, 0.1, 0.3f};
        case TransportAccuracy::final:
            return {0.003, 4, 2.2, 0.001, 4, 0.006, 0.05f};
        case TransportAccuracy::exact:
            break;
    }
    return {.threshold = 0.02f};
}

// Mean square of the slopes, as areas tell.
double steepness_of(const TransportSurface& surface) {
    const double cell = surface.spacing() * surface.spacing();
    double sum = 0;
    std::size_t count = 0;
    for (const float area : surface.area.values) {
        if (!(area > 0)) continue;
        const double stretch = area / cell;
        sum += std::max(stretch * stretch - 1, 0.0);
        ++count;
    }
    return count > 0 ? sum / double(count) : 0;
}

// What a texel's own area adds to its sum; and 0 where nothing is, which a convolution does not know.
void finish(const TransportSurface& surface, const RadialKernel& kernel, const Image& flux,
            Image& out, const Executor& executor, const std::stop_token& stop) {
    parallel_rows(executor, flux.height, stop, [&](RowRange rows) {
        for (int j = rows.begin; j < rows.end; ++j)
            for (int i = 0; i < flux.width; ++i) {
                const float area = surface.area.at(i, j);
                for (int c = 0; c < flux.channels; ++c) {
                    float& sum = out.at(i, j, c);
                    if (!(area > 0)) sum = 0;
                    else sum += float(kernel.at_own_place(c, area)) * flux.at(i, j, c);
                }
            }
    });
}

// Flux where something is.
Image masked(const TransportSurface& surface, const Image& flux) {
    Image out = flux;
    for (std::size_t k = 0; k < surface.area.values.size(); ++k)
        if (!(surface.area.values[k] > 0))
            std::fill_n(out.values.begin() + std::ptrdiff_t(k * flux.channels), flux.channels,
                        0.0f);
    return out;
}

}  // namespace

struct Transport::Parts {
    std::shared_ptr<const TransportSurface> surface;
    std::shared_ptr<const RadialKernel> kernel;
    Simd simd;
    float threshold = 0;
    // One of these.
    std::unique_ptr<KernelSpectrum> spectrum;
    std::unique_ptr<LevelSum> levels;
    std::unique_ptr<TexelTree> tree;

    void prepare(TransportAccuracy accuracy, const Executor& executor,
                 const std::stop_token& stop) {
        const Demands demands = demands_of(accuracy);
        threshold = demands.threshold;
        if (accuracy != TransportAccuracy::exact) {
            if (steepness_of(*surface) <= demands.steepness)
                spectrum = std::make_unique<KernelSpectrum>(*kernel, surface->width(),
                                                            surface->height(), executor, stop);
            else prepare_levels(demands, executor, stop);
        }
        if (!spectrum && !levels) tree = std::make_unique<TexelTree>(*surface, stop, simd);
    }

    // As one sheet from as coarse a level as the kernel allows; else as several; else from the texels.
    void prepare_levels(const Demands& demands, const Executor& executor,
                        const std::stop_token& stop) {
        const double texels = kernel->core() / kernel->spacing() / demands.nodes_to_core;
        const double enough =
            std::min(surface->width(), surface->height()) / 32.0;  // nodes of a side
        const double coarse = std::min(texels, enough);
        const int coarsest = coarse >= 2 ? int(std::log2(coarse)) : 0;
        const auto will_do = [&](int first_level, int sheets, double most) {
            const LevelSum::Settings settings{demands.ratio, first_level, sheets};
            levels = std::make_unique<LevelSum>(*surface, *kernel, settings, executor, stop, simd);
            return levels->cliffs() <= most;
        };
        for (int first_level = coarsest; first_level >= 0; --first_level)
            if (will_do(first_level, 1, demands.cliffs)) return;
        if (will_do(0, demands.sheets, demands.sheets_cliffs)) return;
        levels.reset();
    }
};

Transport::Transport(std::shared_ptr<const TransportSurface> surface,
                     std::shared_ptr<const RadialKernel> kernel, TransportAccuracy accuracy,
                     const Executor& executor, const std::stop_token& stop, Simd simd) {
    auto parts = std::make_unique<Parts>(Parts{std::move(surface), std::move(kernel), simd});
    parts->prepare(accuracy, executor, stop);
    parts_ = std::move(parts);
}

Transport::~Transport() = default;

TransportPath Transport::path() const {
    if (parts_->spectrum) return TransportPath::convolution;
    return parts_->levels ? TransportPath::levels : TransportPath::tree;
}

std::uint64_t Transport::bytes() const {
    if (parts_->spectrum) return parts_->spectrum->bytes();
    if (parts_->levels) return parts_->levels->bytes();
    return parts_->tree->bytes();
}

Image Transport::sum(const Image& flux, const Executor& executor,
                     const std::stop_token& stop) const {
    const TransportSurface& surface = *parts_->surface;
    const RadialKernel& kernel = *parts_->kernel;
    assert(flux.width == surface.width() && flux.height == surface.height());
    assert(flux.channels == kernel.channels());
    Image out;
    if (parts_->spectrum) out = convolved(*parts_->spectrum, masked(surface, flux), executor, stop);
    else if (parts_->levels) out = parts_->levels->sum(flux, executor, stop);
    else out = parts_->tree->sum(kernel, parts_->threshold, flux, executor, stop);
    finish(surface, kernel, flux, out, executor, stop);
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

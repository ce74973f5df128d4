#include "core/image/resample.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace relit {
namespace {

// The source texels that one target texel is made of, along one axis.
struct Taps {
    int first = 0;
    std::vector<float> weights;
};

constexpr int bicubic_reach = 2;

double catmull_rom(double x) {
    x = std::abs(x);
    if (x < 1) return (1.5 * x - 2.5) * x * x + 1;
    if (x < 2) return ((-0.5 * x + 2.5) * x - 4) * x + 2;
    return 0;
}

Taps area_taps(int begin, double scale, int target) {
    const double lo = begin + target * scale;
    const double hi = begin + (target + 1) * scale;
    Taps taps{int(std::floor(lo)), {}};
    for (int i = taps.first; i < hi; ++i) {
        const double covered = std::min<double>(hi, i + 1) - std::max<double>(lo, i);
        if (covered > 1e-9) taps.weights.push_back(float(covered / scale));
        else if (taps.weights.empty()) ++taps.first;
    }
    return taps;
}

Taps bicubic_taps(int begin, double scale, int target, int source_size) {
    const double centre = begin + (target + 0.5) * scale - 0.5;
    const int base = int(std::floor(centre));
    const int first = std::clamp(base - 1, 0, source_size - 1);
    const int last = std::clamp(base + 2, 0, source_size - 1);
    Taps taps{first, std::vector<float>(std::size_t(last - first) + 1)};
    for (int i = base - 1; i <= base + 2; ++i)
        taps.weights[std::clamp(i, first, last) - first] += float(catmull_rom(centre - i));
    return taps;
}

// For some of the targets 0..count-1 laid over source texels begin..begin+size.
std::vector<Taps> taps_of_axis(int begin, int size, int count, int source_size, RowRange targets) {
    const double scale = double(size) / count;
    std::vector<Taps> taps;
    taps.reserve(targets.end - targets.begin);
    for (int i = targets.begin; i < targets.end; ++i) {
        if (count == size) taps.push_back({begin + i, {1.0f}});
        else if (count < size) taps.push_back(area_taps(begin, scale, i));
        else taps.push_back(bicubic_taps(begin, scale, i, source_size));
    }
    return taps;
}

// inf * 0 and inf - inf are NaN; a texel of no weight must not count, and infinity stays infinity.
float weighted_sum(const Taps& taps, const float* values, std::size_t stride) {
    float sum = 0;
    for (std::size_t k = 0; k < taps.weights.size(); ++k)
        if (taps.weights[k] != 0) sum += taps.weights[k] * values[k * stride];
    return std::isfinite(sum) ? sum : std::numeric_limits<float>::infinity();
}

}  // namespace

RowRange resample_reads(RowRange rows, Rect window, int height, int source_height) {
    const auto taps_of = [&](int row) {
        return taps_of_axis(window.y, window.height, height, source_height, {row, row + 1}).front();
    };
    const Taps last = taps_of(rows.end - 1);
    return {taps_of(rows.begin).first, last.first + int(last.weights.size())};
}

Image resample(const Image& source, const ResampledRows& part, Rect window, int width, int height,
               const Executor& executor, const std::stop_token& stop) {
    assert(window.x >= 0 && window.y >= 0 && window.width >= 1 && window.height >= 1);
    assert(window.x + window.width <= source.width &&
           window.y + window.height <= part.source_height);
    assert(width >= 1 && height >= 1);
    const std::vector<Taps> across =
        taps_of_axis(window.x, window.width, width, source.width, {0, width});
    const std::vector<Taps> down =
        taps_of_axis(window.y, window.height, height, part.source_height, part.rows);
    const int first_row = down.front().first;
    const int last_row = down.back().first + int(down.back().weights.size()) - 1;
    assert(first_row >= part.first_row && last_row < part.first_row + source.height);
    const std::size_t channels = source.channels;

    Image narrow(width, last_row - first_row + 1, source.channels);
    parallel_rows(executor, narrow.height, stop, [&](RowRange rows) {
        for (int y = rows.begin; y < rows.end; ++y) {
            const float* in = source.row(first_row - part.first_row + y).data();
            float* out = narrow.row(y).data();
            for (int x = 0; x < width; ++x)
                for (std::size_t c = 0; c < channels; ++c)
                    *out++ = weighted_sum(across[x], in + across[x].first * channels + c, channels);
        }
    });

    Image result(width, int(down.size()), source.channels);
    parallel_rows(executor, result.height, stop, [&](RowRange rows) {
        const std::size_t row_size = std::size_t(width) * channels;
        for (int y = rows.begin; y < rows.end; ++y) {
            const float* in = narrow.row(down[y].first - first_row).data();
            float* out = result.row(y).data();
            for (std::size_t i = 0; i < row_size; ++i)
                out[i] = weighted_sum(down[y], in + i, row_size);
        }
    });
    return result;
}

Image resample(const Image& source, Rect window, int width, int height, const Executor& executor,
               const std::stop_token& stop) {
    return resample(source, {{0, height}, 0, source.height}, window, width, height, executor, stop);
}

Image resample(const Image& source, int width, int height, const Executor& executor,
               const std::stop_token& stop) {
    return resample(source, {0, 0, source.width, source.height}, width, height, executor, stop);
}

Rect resample_support(Rect window, int width, int height, int map_width, int map_height) {
    const int reach_x = width > window.width ? bicubic_reach : 0;
    const int reach_y = height > window.height ? bicubic_reach : 0;
    const int x0 = std::max(0, window.x - reach_x);
    const int y0 = std::max(0, window.y - reach_y);
    const int x1 = std::min(map_width, window.x + window.width + reach_x);
    const int y1 = std::min(map_height, window.y + window.height + reach_y);
    return {x0, y0, x1 - x0, y1 - y0};
}

}  // namespace relit

#include "core/field/map_slopes.h"

#include <algorithm>
#include <vector>

namespace relit {

MapSlopes::MapSlopes(const HeightField& field, double relief, double bump_relief,
                     const Executor& executor)
    : relief_(relief), bump_relief_(bump_relief) {
    if (field.heights.texels() <= most_kept) kept_ = image(field, executor);
}

Image MapSlopes::image(const HeightField& field, const Executor& executor) const {
    if (!kept_.empty()) return kept_;
    Image slopes(field.width(), field.height(), 2);
    parallel_rows(executor, field.height(), {}, [&](RowRange rows) {
        std::vector<float> x(field.width()), y(field.width());
        for (int j = rows.begin; j < rows.end; ++j) {
            work_out(field, 0, j, field.width(), 1, x.data(), y.data());
            float* out = slopes.row(j).data();
            for (int i = 0; i < field.width(); ++i) {
                out[2 * i] = x[i];
                out[2 * i + 1] = y[i];
            }
        }
    });
    return slopes;
}

void MapSlopes::load(const HeightField& field, int i, int j, int count, float scale, float* x,
                     float* y) const {
    if (kept_.empty()) return work_out(field, i, j, count, scale, x, y);
    const float* in = &kept_.row(j)[2 * std::size_t(i)];
    for (int n = 0; n < count; ++n) {
        x[n] = scale * in[2 * n];
        y[n] = scale * in[2 * n + 1];
    }
}

void MapSlopes::work_out(const HeightField& field, int i, int j, int count, float scale, float* x,
                         float* y) const {
    const bool has_bump = bump_relief_ != 0 && !field.bump.empty();
    int n = 0;
    const auto one = [&] {
        const Slopes own = slopes_at(field, relief_, i + n, j);
        float right = float(own.x), up = float(own.y);
        if (has_bump) {  // h + b has the sum of their slopes
            const Slopes bump = slopes_at(field, field.bump, bump_relief_, i + n, j);
            right += float(bump.x);
            up += float(bump.y);
        }
        x[n] = scale * right;
        y[n] = scale * up;
    };
    const bool is_plain = field.alpha.empty() && !has_bump && j > 0 && j + 1 < field.height();
    if (is_plain && count > 1) {
        if (i == 0) one(), ++n;
        // As slopes_at(), without a question to each texel.
        const int width = field.width(), end = std::min(count, width - 1 - i);
        const double per_texel = relief_ * width;
        const float* h = field.heights.row(j).data() + i;
        for (int k = n; k < end; ++k)
            x[k] = scale * float(per_texel * ((double(h[k + 1]) - h[k - 1]) / 2));
        const float *above = h - width, *below = h + width;
        for (int k = n; k < end; ++k)
            y[k] = scale * float(per_texel * ((double(above[k]) - below[k]) / 2));
        n = std::max(n, end);
    }
    for (; n < count; ++n) one();
}

}  // namespace relit

// Slopes of a whole map, for everything that shades its texels: kept where the map is small.
#pragma once

#include <cstdint>

#include "core/base/parallel.h"
#include "core/field/normals.h"

namespace relit {

/// dz/dx and dz/dy of every texel. Of a map of more than `most_kept` texels they are worked out where
/// they are asked for: twice the map's memory would save a few per cent of a frame's time.
class MapSlopes {
public:
    static constexpr std::size_t most_kept = std::size_t(1) << 22;

    /// Of a map without slopes.
    MapSlopes() = default;
    /// @param bump_relief  z of height 1 of the bump map, whose slopes are added; 0: they are not
    MapSlopes(const HeightField& field, double relief, double bump_relief,
              const Executor& executor);

    [[nodiscard]] bool empty() const { return relief_ == 0; }
    [[nodiscard]] std::uint64_t bytes() const { return kept_.values.size() * sizeof(float); }

    /// Those of `count` texels of row j from column i on, times `scale`.
    /// @param field  that this was made of, here and below
    void load(const HeightField& field, int i, int j, int count, float scale, float* x,
              float* y) const;
    [[nodiscard]] Slopes at(const HeightField& field, int i, int j) const {
        float x, y;
        load(field, i, j, 1, 1, &x, &y);
        return {x, y};
    }
    /// All of them, 2 channels.
    [[nodiscard]] Image image(const HeightField& field, const Executor& executor) const;

    /// Asks for what load() of these texels will read.
    void prefetch(int i, int j, int count) const {
        constexpr int line = 16;  // floats of a line of the cache
        if (kept_.empty()) return;
        const float* first = &kept_.row(j)[2 * std::size_t(i)];
        for (int n = 0; n < 2 * count; n += line) __builtin_prefetch(first + n);
    }

private:
    void work_out(const HeightField& field, int i, int j, int count, float scale, float* x,
                  float* y) const;

    double relief_ = 0, bump_relief_ = 0;
    Image kept_;  // 2 channels, or empty
};

}  // namespace relit

// A solid as the elevation-band march sees it: 16-bit heights smoothed to several widths, and the
// highest ones round about. For sky_transfer.cpp.
#pragma once

#include <vector>

#include "core/base/parallel.h"
#include "core/field/solid.h"
#include "core/visibility/kernels/bands.h"

namespace relit {

/// Heights in texels (of the map's width), level after level; each is smoothed about twice as far as
/// the one before, over material alone. See kernels::BandLevel.
class SkyLevels {
public:
    /// @param room  texels of height that starts of rays may lie below the lowest height
    SkyLevels(const Solid& solid, double room, int levels, const Executor& executor);

    /// Fills in what the march takes from here.
    void describe(kernels::BandScenery& scenery) const;

    /// No height within `distance` texels of the 32 texels from (column, row) on is above it.
    [[nodiscard]] float highest_near(int column, int row, float distance) const;

    /// Whether all within `distance` texels of them is material.
    [[nodiscard]] bool is_whole_near(int column, int row, float distance) const;

private:
    template <class Value>
    [[nodiscard]] Value most_near(const std::vector<std::vector<Value>>& tiles, int column, int row,
                                  float distance) const;
    [[nodiscard]] std::size_t place_of(int level, int i, int j) const;
    void fill_first(const Solid& solid, const Executor& executor);
    void smooth(int level, const Executor& executor);
    void repeat_border(int level);
    void survey(const Solid& solid);

    int width_, height_, levels_, pitch_;
    float lowest_ = 0, unit_ = 0;
    std::vector<unsigned short> texels_;
    int tiles_across_, tiles_down_;
    std::vector<std::vector<float>> highest_;  // within 1, 2, 4 ... tiles of each
    std::vector<std::vector<char>> holed_;     // alike: whether a texel is masked
};

}  // namespace relit

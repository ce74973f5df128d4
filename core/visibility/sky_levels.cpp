#include "core/visibility/sky_levels.h"

#include <algorithm>
#include <cmath>

namespace relit {
namespace {

constexpr int margin = kernels::level_margin;
constexpr int rows_around = kernels::level_rows_around;
constexpr int tile = 16;
constexpr int steps_of_height = 65530;  // a quarter of it is a far height, below 2^14

bool is_material(const Solid& solid, int i, int j) {
    if (solid.cover.empty()) return true;
    // As the upper left texel of the cell to its lower right.
    return solid.cover[std::size_t(j + 1) * (solid.width + 1) + (i + 1)] & 1;
}

// Most of a number and its neighbours `reach` tiles away.
template <class Value>
std::vector<Value> dilated(const std::vector<Value>& from, int across, int down, int reach) {
    const auto place = [&](int p, int q) {
        return std::size_t(std::clamp(q, 0, down - 1)) * across + std::clamp(p, 0, across - 1);
    };
    std::vector<Value> to = from;
    for (int q = 0; q < down; ++q)
        for (int p = 0; p < across; ++p)
            for (const int y : {q - reach, q, q + reach})
                for (const int x : {p - reach, p, p + reach})
                    to[place(p, q)] = std::max(to[place(p, q)], from[place(x, y)]);
    return to;
}

// Within 1, 2, 4 ... tiles, until that is all of the map.
template <class Value>
std::vector<std::vector<Value>> all_dilated(const std::vector<Value>& tiles, int across, int down) {
    std::vector<std::vector<Value>> levels{dilated(tiles, across, down, 1)};
    for (int reach = 1; reach < std::max(across, down); reach *= 2)
        levels.push_back(dilated(levels.back(), across, down, reach));
    return levels;
}

}  // namespace

SkyLevels::SkyLevels(const Solid& solid, double room, int levels, const Executor& executor)
    : width_(solid.width),
      height_(solid.height),
      levels_(levels),
      pitch_((solid.width + 2 * margin + 31) / 32 * 32 + 32),
      tiles_across_((solid.width + tile - 1) / tile),
      tiles_down_((solid.height + tile - 1) / tile) {
    const double lowest = solid.endless_ground ? 0 : solid.floor_z;
    lowest_ = float(solid.width * lowest);
    unit_ = float((solid.width * (solid.top_z - lowest) + 2 * room) / steps_of_height);
    texels_.resize(std::size_t(levels) * pitch_ * (height_ + 2 * rows_around));
    fill_first(solid, executor);
    for (int level = 0; level < levels; ++level) {
        if (level > 0) smooth(level, executor);
        repeat_border(level);
    }
    survey(solid);
}

std::size_t SkyLevels::place_of(int level, int i, int j) const {
    const std::size_t row = std::size_t(level) * (height_ + 2 * rows_around) + j + rows_around;
    return row * pitch_ + margin + i;
}

void SkyLevels::fill_first(const Solid& solid, const Executor& executor) {
    parallel_rows(executor, height_, {}, [&](RowRange rows) {
        for (int j = rows.begin; j < rows.end; ++j)
            for (int i = 0; i < width_; ++i) {
                const float z = float(width_) * solid.z.at(i + 1, j + 1);
                const auto texel = unsigned(std::max(0.0f, (z - lowest_) / unit_ + 0.5f)) & ~1u;
                texels_[place_of(0, i, j)] =
                    static_cast<unsigned short>(texel | unsigned(is_material(solid, i, j)));
            }
    });
}

// Weights 1, 2, 1 of the level below at distances 0 and 2^(level - 1): without holes, since that
// one has been smoothed by as much.
void SkyLevels::smooth(int level, const Executor& executor) {
    const int reach = 1 << (level - 1);
    parallel_rows(executor, height_, {}, [&](RowRange rows) {
        std::vector<unsigned> heights(width_ + 2 * reach), weights(width_ + 2 * reach);
        for (int j = rows.begin; j < rows.end; ++j) {
            std::fill(heights.begin(), heights.end(), 0);
            std::fill(weights.begin(), weights.end(), 0);
            const auto add_row = [&](int y, unsigned weight) {
                if (y < 0 || y >= height_) return;
                const unsigned short* from = &texels_[place_of(level - 1, 0, y)];
                for (int i = 0; i < width_; ++i) {
                    const unsigned w = weight & -(from[i] & 1u);
                    heights[i + reach] += w * from[i];
                    weights[i + reach] += w;
                }
            };
            add_row(j - reach, 1);
            add_row(j, 2);
            add_row(j + reach, 1);
            const unsigned short* own = &texels_[place_of(level - 1, 0, j)];
            unsigned short* to = &texels_[place_of(level, 0, j)];
            const unsigned *h = heights.data() + reach, *w = weights.data() + reach;
            for (int i = 0; i < width_; ++i) {
                const unsigned sum = h[i - reach] + 2 * h[i] + h[i + reach];
                const unsigned weight = w[i - reach] + 2 * w[i] + w[i + reach];
                const float mean = float(sum) / float(std::max(weight, 1u));
                const unsigned kept = weight > 0 ? unsigned(mean + 0.5f) : own[i];
                to[i] = static_cast<unsigned short>((kept & ~1u) | (own[i] & 1u));
            }
        }
    });
}

void SkyLevels::repeat_border(int level) {
    const auto without_material = [](unsigned short texel) {
        return static_cast<unsigned short>(texel & ~1u);
    };
    for (int j = 0; j < height_; ++j) {
        unsigned short* row = &texels_[place_of(level, 0, j)];
        std::fill(row - margin, row, without_material(row[0]));
        std::fill(row + width_, row - margin + pitch_, without_material(row[width_ - 1]));
    }
    for (int k = 1; k <= rows_around; ++k)
        for (int i = -margin; i < pitch_ - margin; ++i) {
            texels_[place_of(level, i, -k)] = without_material(texels_[place_of(level, i, 0)]);
            texels_[place_of(level, i, height_ - 1 + k)] =
                without_material(texels_[place_of(level, i, height_ - 1)]);
        }
}

void SkyLevels::survey(const Solid& solid) {
    std::vector<float> highest(std::size_t(tiles_across_) * tiles_down_, lowest_);
    std::vector<char> holed(highest.size());
    for (int j = 0; j < height_; ++j)
        for (int i = 0; i < width_; ++i) {
            const std::size_t place = std::size_t(j / tile) * tiles_across_ + i / tile;
            if (is_material(solid, i, j))
                highest[place] = std::max(highest[place], float(width_) * solid.z.at(i + 1, j + 1));
            else holed[place] = 1;
        }
    highest_ = all_dilated(highest, tiles_across_, tiles_down_);
    holed_ = all_dilated(holed, tiles_across_, tiles_down_);
}

void SkyLevels::describe(kernels::BandScenery& scenery) const {
    for (int level = 0; level < levels_; ++level)
        scenery.levels[level].texels = &texels_[place_of(level, 0, 0)];
    scenery.pitch = pitch_;
    scenery.width = width_;
    scenery.height = height_;
    scenery.lowest = lowest_;
    scenery.height_unit = unit_;
}

template <class Value>
Value SkyLevels::most_near(const std::vector<std::vector<Value>>& tiles, int column, int row,
                           float distance) const {
    const int last = std::min(column + kernels::band_texels - 1, width_ - 1);
    std::size_t level = 0;
    while (level + 1 < tiles.size() && distance > float(tile << level)) ++level;
    const Value* in_row = &tiles[level][std::size_t(row / tile) * tiles_across_];
    return *std::max_element(in_row + column / tile, in_row + last / tile + 1);
}

float SkyLevels::highest_near(int column, int row, float distance) const {
    return most_near(highest_, column, row, distance);
}

bool SkyLevels::is_whole_near(int column, int row, float distance) const {
    const int reach = int(std::ceil(distance));
    return column >= reach && row >= reach && column + kernels::band_texels + reach <= width_ &&
           row + reach < height_ && !most_near(holed_, column, row, distance);
}

}  // namespace relit

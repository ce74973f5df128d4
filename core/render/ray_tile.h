// Texels of one square of the map as packets of rays take them, and numbers for each of them: what
// shading in tiles is made of. For shader.cpp and surface_light.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>

#include "core/base/rect.h"
#include "core/field/map_slopes.h"
#include "core/light/light.h"
#include "core/shade/material.h"
#include "core/visibility/inside_lengths.h"

namespace relit {

/// A number per texel of a tile.
struct alignas(64) TileNumbers : std::array<float, RayTile::max_rays> {};

/// A number as pictures hold it: what is beyond all floats is the largest.
inline float stored(float value) { return std::min(value, std::numeric_limits<float>::max()); }

inline RayTarget target_of(const LightSample& sample) { return {sample.at, sample.at_infinity}; }

/// ramp() of factors.h in float, for whole tiles.
class TileRamp {
public:
    explicit TileRamp(Falloff falloff)
        : lo_(float(falloff.lo)), inverse_(float(1 / (falloff.hi - falloff.lo))) {}
    float operator()(float c) const { return std::min(std::max((c - lo_) * inverse_, 0.0f), 1.0f); }

private:
    float lo_, inverse_;
};

/// Calls `visit` with each run of texels side by side: the place of its first one in the list, its
/// size, and the first one.
template <class Visit>
void for_each_run(std::span<const TexelIndex> texels, const Visit& visit) {
    for (std::size_t begin = 0; begin < texels.size();) {
        const TexelIndex first = texels[begin];
        // Whole rows of a square are told by their ends.
        const std::size_t whole = begin + RayTile::side - 1;
        std::size_t end = begin + 1;
        if (whole < texels.size() && texels[whole].j == first.j &&
            texels[whole].i == first.i + RayTile::side - 1)
            end = whole + 1;
        else
            while (end < texels.size() && texels[end].j == first.j &&
                   texels[end].i == first.i + int(end - begin))
                ++end;
        visit(begin, end - begin, first);
        begin = end;
    }
}

/// Copies a run of texels. Most are whole rows of a square, too short for a call.
inline void copy_run(const float* from, std::size_t size, float* to) {
    if (size == RayTile::side) std::memcpy(to, from, RayTile::side * sizeof(float));
    else std::copy_n(from, size, to);
}

/// Rays that start on the surface, at texels of one square. @pre 1 to RayTile::max_rays texels
inline RayTile surface_starts(const Solid& solid, std::span<const TexelIndex> texels) {
    assert(!texels.empty() && texels.size() <= RayTile::max_rays);
    constexpr int side = RayTile::side;
    RayTile tile;
    tile.column = texels[0].i / side * side;
    tile.row = texels[0].j / side * side;
    tile.count = int(texels.size());
    for_each_run(texels, [&](std::size_t k, std::size_t size, TexelIndex at) {
        assert(at.i / side * side == tile.column && at.j / side * side == tile.row);
        copy_run(&solid.z.row(at.j + 1)[at.i + 1], size, &tile.z[k]);
        for (std::size_t n = 0; n < size; ++n)
            tile.right[k + n] = float(at.i - tile.column + int(n));
        for (std::size_t n = 0; n < size; ++n) tile.down[k + n] = float(at.j - tile.row);
    });
    return tile;
}

/// Slopes of the texels times `scale`. @param field  that `slopes` was made of
inline void load_slopes(const MapSlopes& slopes, const HeightField& field,
                        std::span<const TexelIndex> texels, float scale, TileNumbers& x,
                        TileNumbers& y) {
    for_each_run(texels, [&](std::size_t k, std::size_t size, TexelIndex at) {
        slopes.load(field, at.i, at.j, int(size), scale, &x[k], &y[k]);
    });
}

/// Sums of a colour per texel of a tile.
struct TileSums {
    TileNumbers r{}, g{}, b{};

    void add(int count, const TileNumbers& share, Rgb colour) {
        const float cr = float(colour.r), cg = float(colour.g), cb = float(colour.b);
        for (int k = 0; k < count; ++k) r[k] += share[k] * cr;
        for (int k = 0; k < count; ++k) g[k] += share[k] * cg;
        for (int k = 0; k < count; ++k) b[k] += share[k] * cb;
    }
    void add(int count, const TileSums& other) {
        for (int k = 0; k < count; ++k) r[k] += other.r[k];
        for (int k = 0; k < count; ++k) g[k] += other.g[k];
        for (int k = 0; k < count; ++k) b[k] += other.b[k];
    }
    void add(int k, Rgb colour) {
        r[k] += float(colour.r);
        g[k] += float(colour.g);
        b[k] += float(colour.b);
    }
    [[nodiscard]] Rgb at(int k) const { return {r[k], g[k], b[k]}; }
};

/// Unit vectors from the starts of rays to a light.
struct TileDirections {
    TileNumbers x, y, z;

    TileDirections(const Solid& solid, const RayTarget& light, const RayTile& tile) {
        const Vec3 at = light.at;
        if (light.at_infinity) {
            x.fill(float(at.x));
            y.fill(float(at.y));
            z.fill(float(at.z));
            return;
        }
        const float texel = 1 / float(solid.width);
        const float right = float(at.x * solid.width - 0.5 - tile.column);
        const float down = float(solid.height - 0.5 - at.y * solid.width - tile.row);
        for (int k = 0; k < tile.count; ++k) {
            const float to_x = texel * (right - tile.right[k]);
            const float to_y = -texel * (down - tile.down[k]);
            const float to_z = float(at.z) - tile.z[k];
            const float square = to_x * to_x + to_y * to_y + to_z * to_z;
            const float inverse = square > 0 ? 1 / std::sqrt(square) : 0;
            x[k] = inverse * to_x;
            y[k] = inverse * to_y;
            z[k] = square > 0 ? inverse * to_z : 1;
        }
    }
};

}  // namespace relit

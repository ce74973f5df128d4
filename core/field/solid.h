// The solid under a height map: what light has to cross. For visibility, which asks it for lengths
// and samples. Source: integrated model, section 1 (Space and units).
#pragma once

#include <cstdint>

#include "core/base/vec.h"
#include "core/field/height_field.h"

namespace relit {

/// Where material ends below.
struct Base {
    enum class Kind {
        none,  ///< no floor: everything below z = 0 is solid, also outside the map and the mask
        automatic,  ///< a floor at z = -depth
        level,      ///< a floor at z = `level`
    };
    Kind kind = Kind::none;
    double level = 0;  ///< scene units, with Kind::level

    friend bool operator==(const Base&, const Base&) = default;
};

/// What a square of block_size x block_size cells holds: a ray that stays at or above `top` meets
/// nothing in it, one that stays below `bottom` nothing but material.
struct Block {
    float top = 0;     ///< highest grid point of cells with material; -infinity where there is none
    float bottom = 0;  ///< lowest grid point; -infinity where a part of a cell is masked
};

/// Heights of grid points, row after row. Each row begins with a line of the cache and has its ends
/// repeated outwards: `margin` points to the left, twice `window` or more to the right, so that packets
/// of rays may read beyond them.
struct GridHeights {
    static constexpr int margin = 16, window = 32;

    int width = 0;   ///< grid points of a row, without those beyond its ends
    int height = 0;  ///< rows
    int pitch = 0;   ///< floats from row to row
    Texels values;

    GridHeights() = default;
    GridHeights(int points_across, int rows);

    [[nodiscard]] float* row(int v) { return values.data() + std::size_t(v) * pitch + margin; }
    [[nodiscard]] const float* row(int v) const {
        return values.data() + std::size_t(v) * pitch + margin;
    }
    [[nodiscard]] float& at(int u, int v) { return row(v)[u]; }
    [[nodiscard]] float at(int u, int v) const { return row(v)[u]; }

    /// Repeats the ends of row v.
    void repeat_ends(int v);
};

/// Heights as a bilinear surface in scene units, with the mask and the floor, ready for ray
/// marching.
///
/// Texel coordinates (u, v): texel (i, j) has its centre at (i + 1, j + 1), v grows downwards. The
/// grid is the map with its border repeated once, so that the map covers 0.5 <= u <= width + 0.5
/// and every point of it lies between four grid points.
struct Solid {
    static constexpr int block_size = 8;

    int width = 0;  ///< texels of the map
    int height = 0;
    GridHeights z;  ///< (width + 2) x (height + 2) grid points, scene units
    /// Per cell of the grid, (width + 1) x (height + 1): bit a + 2 b says whether the texel nearest
    /// to the cell's quarter (a, b), 1 = right, lower, is material. Empty: all is.
    std::vector<std::uint8_t> cover;
    std::vector<Block> blocks;  ///< of the grid's cells, rows of blocks_across
    int blocks_across = 0;
    bool endless_ground = true;  ///< Base::Kind::none
    double floor_z = 0;  ///< material of the map lies at floor_z <= z; 0 over endless ground
    double top_z = 0;    ///< no grid point is higher

    /// The block that holds cell (i, j) of the grid.
    [[nodiscard]] const Block& block_of_cell(int i, int j) const {
        return blocks[std::size_t(j / block_size) * blocks_across + i / block_size];
    }

    [[nodiscard]] double u_of(double x) const { return x * width + 0.5; }
    [[nodiscard]] double v_of(double y) const { return height + 0.5 - y * width; }
    /// Size in memory.
    [[nodiscard]] std::uint64_t bytes() const {
        return z.values.size() * sizeof(float) + cover.size() + blocks.size() * sizeof(Block);
    }
    /// Upper end of y: the lower one is 0, and x lies in [0, 1].
    [[nodiscard]] double y_size() const { return double(height) / width; }
};

/// @param relief  z of height 1 in scene units, > 0
/// @param depth   t of section 2, scene units: the floor of Base::Kind::automatic is at -depth
[[nodiscard]] Solid make_solid(const HeightField& field, double relief, Base base, double depth);

/// Surface height in scene units at (x, y), bilinear. @pre (x, y) lies on the map (asserted)
[[nodiscard]] double surface_z(const Solid& solid, double x, double y);

/// Whether `p` lies inside the solid (section 1): the definition, point by point.
[[nodiscard]] bool is_inside(const Solid& solid, Vec3 p);

/// Centre of texel (i, j) on the surface.
[[nodiscard]] inline Vec3 surface_point(const Solid& solid, int i, int j) {
    return {(i + 0.5) / solid.width, (solid.height - 0.5 - j) / solid.width,
            solid.z.at(i + 1, j + 1)};
}

}  // namespace relit

// The packet march: r of many rays towards one light, a packet of neighbours at a time, once per
// instruction set. For inside_lengths(), which makes the grids and checks the numbers; nothing else
// calls it. Sources: Amanatides and Woo 1987 for the walk, here row by row for a whole packet.
//
// The sources of this folder are compiled for processors that the rest of the program does not ask
// for. An inline function of a common header could be kept by the linker in their version, so they
// include nothing that has any, and this header holds plain data only.
#pragma once

namespace relit::kernels {

/// Top and bottom of a group of cells, as Block, moved apart by more than rounding can do.
struct Bounds {
    float top, bottom;
    /// Times |slide|, columns per row, at least what the surface leaves the straight line by, along a
    /// ray from row to row.
    float bend;
};

/// The surface as rays see it whose way is mostly along v: by rows. A copy with u and v exchanged
/// serves the others.
///
/// Grid points as in Solid, repeated outwards by at least `grid_margin` on the left and
/// `2 * grid_window` on the right. With a mask the lowest bit of a height says whether its texel is
/// material.
struct Grid {
    const float* z = nullptr;   ///< grid point (0, 0), at the beginning of a line of the cache
    int pitch = 0;              ///< floats from row to row
    int columns = 0, rows = 0;  ///< cells
    const Bounds* near =
        nullptr;  ///< 8 rows of cells x 32 columns, from every 8th row and column on
    const Bounds* far = nullptr;  ///< 32 rows x 64 columns, from every 32nd row and 8th column on
    int bounds_across = 0;        ///< entries per row of each table
    float rounding = 0;  ///< more than floats lose where heights of rays and surface are compared
};
inline constexpr int grid_margin = 16;
inline constexpr int grid_window = 32;

/// All that the rays of a call have in common.
struct Scenery {
    Grid by_rows, by_columns;
    bool masked = false;
    bool endless_ground = true;
    double floor_z = 0, top_z = 0;
    int width = 0, height = 0;    ///< of the map, texels
    double light[3] = {0, 0, 0};  ///< as Light of inside_lengths.h
    bool at_infinity = false;
};

/// Rays that a call takes at most.
inline constexpr int max_rays = 256;

/// Rays that start near the texels of one square of the map.
struct Tile {
    int column = 0,
        row = 0;    ///< the grid point that starts count from: its texel at the upper left
    int count = 0;  ///< of rays, <= max_rays; max_rays: row by row of a square
    // Where they start: texels right of and below that grid point, z in scene units.
    const float *right = nullptr, *down = nullptr, *z = nullptr;
};
inline constexpr int tile_side = 16;  ///< texels of a square of max_rays

/// r of the rays of a tile to the light, into `r`; NaN where it is for March to say: for lights
/// below all that is solid, and starts outside the map or below its floor.
using TileMarch = void(const Scenery& scenery, const Tile& tile, float* r);

/// r of `count` rays from `from` (x, y, z each) to the light, into `r`; NaN where the numbers are
/// not such that floats can do it.
using March = void(const Scenery& scenery, const double* from, int count, double* r);

March march_portable;
March march_avx2;
March march_avx512;
TileMarch march_tile_portable;
TileMarch march_tile_avx2;
TileMarch march_tile_avx512;

}  // namespace relit::kernels

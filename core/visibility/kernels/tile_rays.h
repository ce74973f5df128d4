// Rays of a tile as packets, in float: positions count from the tile's grid point, so that floats are as
// exact as the heights are. For march_tile.h.
#pragma once

#include "core/visibility/kernels/steps.h"

namespace relit::kernels {
namespace {

// The light of a tile as one of the grids sees it: texels along its rows' order and across, from the
// tile's grid point.
struct TileLight {
    float along, across, z;  // place, or direction
    bool at_infinity;
    float texel;        // width of one in scene units
    float slide, rise;  // per step, of a light at infinity
};

// Which way a packet's rays go through a grid, and what of it lies around the tile.
struct TileWay {
    const Grid* grid;
    bool by_columns;
    bool backwards;
    TileLight light;
    float first_row, last_row;        // where the map begins and ends along the way, from the tile
    float first_column, last_column;  // and across it
    int row, column;                  // of the grid: the tile's grid point
};

RELIT_INLINE TileWay tile_way(const Scenery& s, const Tile& tile, bool by_columns, bool backwards) {
    const double width = s.width;
    const double right =
        s.at_infinity ? width * s.light[0] : s.light[0] * width + 0.5 - tile.column;
    const double down =
        s.at_infinity ? -width * s.light[1] : (s.height + 0.5) - s.light[1] * width - tile.row;
    TileWay way;
    way.grid = by_columns ? &s.by_columns : &s.by_rows;
    way.by_columns = by_columns;
    way.backwards = backwards;
    way.light = {float(by_columns ? right : down), float(by_columns ? down : right),
                 float(s.light[2]), s.at_infinity, float(1 / width)};
    const float steps = way.light.along < 0 ? -way.light.along : way.light.along;
    const float per_step = 1 / (steps > 1e-6f ? steps : 1e-6f);
    way.light.slide = way.light.across * per_step;
    way.light.rise = way.light.z * per_step;
    way.row = by_columns ? tile.column : tile.row;
    way.column = by_columns ? tile.row : tile.column;
    way.first_row = 0.5f - float(way.row);
    way.last_row = float(way.grid->rows) - 0.5f - float(way.row);
    way.first_column = 0.5f - float(way.column);
    way.last_column = float(way.grid->columns) - 0.5f - float(way.column);
    return way;
}

// What is known of the rays of a packet that go one way besides the packet.
struct TileRays {
    Floats along, across;  // where they start, from the tile's grid point
    Mask taken;            // those that go this way
    Floats distance;       // steps to the light
    Floats ground;         // steps in the ground before they start
    Floats step_length;    // scene units
};

// Fills in `p` what is the same wherever its rays end.
// @param masked_ground  there is a mask over endless ground: rays start where they leave the ground,
//                       since what is masked above it is none of it
RELIT_INLINE TileRays tile_rays(const TileWay& way, Floats along, Floats across, Floats z,
                                bool masked_ground, Packet& p) {
    const Floats one = broadcast(1.0f), zero = broadcast(0.0f);
    const TileLight& light = way.light;
    const auto to_light = [&](float place, Floats from) {
        return light.at_infinity ? broadcast(place) : broadcast(place) - from;
    };
    TileRays rays;
    rays.along = along;
    rays.across = across;
    const Floats way_along = to_light(light.along, along);
    const Floats way_across = to_light(light.across, across), way_z = to_light(light.z, z);
    const Floats longer = magnitude(way.by_columns ? way_across : way_along);
    const Mask is_by_columns =
        way.by_columns ? longer < magnitude(way_along) : longer < magnitude(way_across);
    const Mask is_backwards = way_along < zero;
    rays.taken = (way.backwards ? is_backwards : ~is_backwards) &
                 (way.by_columns ? is_by_columns : ~is_by_columns);

    if (light.at_infinity) {
        rays.distance = broadcast(1e30f);
        p.slide = broadcast(light.slide);
        p.rise = broadcast(light.rise);
    } else {
        // Straight up is all but straight: some row has to be the next.
        rays.distance = max(magnitude(way_along), broadcast(1e-6f));
        const Floats per_step = one / rays.distance;
        p.slide = way_across * per_step;
        p.rise = way_z * per_step;
    }
    const Floats sign = broadcast(way.backwards ? -1.0f : 1.0f);
    rays.ground = zero;
    if (masked_ground && any(z < zero)) {
        rays.ground = select(z < zero, (zero - z) / p.rise, zero);
        rays.along = along + sign * rays.ground;
        rays.across = across + p.slide * rays.ground;
        rays.distance = rays.distance - rays.ground;
        z = max(z, zero);
    }
    const Floats begins = sign * rays.along, row = floor(begins);
    p.begin = begins - row;
    p.row = broadcast(way.row) + to_ints(sign * row);
    p.column = broadcast(way.column);
    p.x = rays.across - p.begin * p.slide;
    p.z = z;
    const Floats texel = broadcast(light.texel);
    rays.step_length = square_root((one + p.slide * p.slide) * (texel * texel) + p.rise * p.rise);
    return rays;
}

// Where the rays of a packet end, one by one: in last and end of the packet.
struct TileEnds {
    Mask left;         // rays that are not for tiles
    Floats elsewhere;  // steps in the ground beside the map
};

RELIT_INLINE TileEnds end_rays(const Scenery& s, const TileWay& way, const TileRays& rays,
                               Packet& p) {
    const Floats zero = broadcast(0.0f), one = broadcast(1.0f), endless = broadcast(1e30f);
    // Steps from row 0 to where the way leaves the map, to the light, and over everything.
    const Floats row = broadcast(way.backwards ? -1.0f : 1.0f) * rays.along - p.begin;
    const Floats border = broadcast(way.backwards ? -way.first_row : way.last_row);
    const Floats inverse_slide = one / p.slide;
    const Floats beside = (broadcast(way.last_column) - p.x) * inverse_slide;
    const Floats before = (broadcast(way.first_column) - p.x) * inverse_slide;
    const Floats leaves = min(border - row, min(max(beside, before), endless));
    const Floats reaches = way.light.at_infinity ? endless : rays.distance + p.begin;
    const Floats inverse_rise = one / p.rise;
    const Floats to_top = (broadcast(float(s.top_z)) - p.z) * inverse_rise + p.begin;
    const Floats over_top = select(zero < p.rise, to_top, endless);
    const Floats end = min(min(leaves, reaches), max(one, ceil(over_top)));
    p.last = max(zero, ceil(end) - one);
    p.end = select(zero < p.last, end - p.last, end - p.begin);

    TileEnds ends;
    ends.elsewhere = zero;
    if (s.endless_ground && any(p.z < zero)) {
        const Floats out_of_ground = (zero - p.z) * inverse_rise + p.begin;
        ends.elsewhere = select(p.z < zero, max(zero, out_of_ground - leaves), zero);
    }
    const auto between = [](float low, Floats a, float high) {
        return (broadcast(low) <= a) & (a <= broadcast(high));
    };
    const Mask starts_on_map = between(way.first_row, rays.along, way.last_row) &
                               between(way.first_column, rays.across, way.last_column);
    const Mask over_floor =
        s.endless_ground ? all_lanes : broadcast(float(s.floor_z) - 1e-7f) <= p.z;
    ends.left = ~(starts_on_map & over_floor);
    p.last = select(rays.taken & ~ends.left, p.last, broadcast(-1.0f));
    return ends;
}

}  // namespace
}  // namespace relit::kernels

// Rays in units of the grid that they are marched over, some at a time, in double: what a packet
// (packet.h) is filled with. Compiled for each instruction set, as that is.
#pragma once

#include "core/visibility/kernels/march.h"

namespace relit::kernels {
namespace {

constexpr double infinity = __builtin_inf();

// Which grid a ray takes, and whether it goes along its rows or against them.
enum Kind : int { rows_down, rows_up, columns_down, columns_up, kinds };

// Half a packet of them to a register.
constexpr int batch = lanes / 2;
using Truths = long long __attribute__((vector_size(register_size)));

RELIT_INLINE Doubles all_of(double a) { return Doubles{} + a; }
RELIT_INLINE Doubles smaller(Doubles a, Doubles b) { return a < b ? a : b; }
RELIT_INLINE Doubles larger(Doubles a, Doubles b) { return a > b ? a : b; }
RELIT_INLINE Doubles size(Doubles a) { return a < 0 ? -a : a; }
RELIT_INLINE Doubles ceil(Doubles a) { return -floor(-a); }

// A part of a ray's way.
struct Span {
    Doubles begin, end;
    // Narrows it to where lo <= origin + k * speed <= hi.
    RELIT_INLINE void clip(Doubles origin, Doubles speed, Doubles inverse, double lo, double hi) {
        const Doubles at_lo = (lo - origin) * inverse, at_hi = (hi - origin) * inverse;
        const Truths still = speed == 0, outside = (origin < lo) | (origin > hi);
        begin = still ? begin : larger(begin, smaller(at_lo, at_hi));
        end = still & outside ? begin : still ? end : smaller(end, larger(at_lo, at_hi));
    }
};

// Rays in units of a grid. Row 0 of a ray is the last one at or before its beginning; the position
// there is extrapolated. Steps are counted from it, step n from row n to row n + 1.
struct Rays {
    Doubles row;          // of the grid
    Doubles column;       // whole part of the position at row 0 of the ray
    Doubles x;            // the rest of it
    Doubles begin;        // where in step 0 it begins, [0, 1]
    Doubles z;            // height there: a steep ray's height at row 0 would be lost in rounding
    Doubles slide, rise;  // of x and z per step
    Doubles last;         // step in which it ends; -1 where nothing is to be marched
    Doubles end;          // there, counted from its row; from the beginning where last is 0
    Doubles step_length;  // scene units
    Doubles elsewhere;    // r outside the map: in the ground beside it and below
};

// Beyond these numbers a float has no fractions of a texel left, or a square overflows.
constexpr double farthest_start = 1e6, farthest_light = 1e15;

// Rays of one kind.
RELIT_INLINE Rays prepared(const Scenery& s, bool by_columns, bool backwards, Doubles x, Doubles y,
                           Doubles z) {
    const Doubles none = {};
    // As ray_to_point() and ray_along() have it.
    const Doubles to_x = all_of(s.light[0]), to_y = all_of(s.light[1]), to_z = all_of(s.light[2]);
    const Doubles way_x = s.at_infinity ? to_x : to_x - x;
    const Doubles way_y = s.at_infinity ? to_y : to_y - y;
    const Doubles way_z = s.at_infinity ? to_z : to_z - z;
    const Doubles length =
        s.at_infinity ? all_of(1) : square_root(way_x * way_x + way_y * way_y + way_z * way_z);
    const Doubles inverse = s.at_infinity ? all_of(1) : length > 0 ? 1 / length : none;
    const auto without_trace = [&](Doubles c) { return size(c) < 1e-12 ? none : c; };
    const Doubles dx = without_trace(inverse * way_x), dy = without_trace(inverse * way_y);
    const Doubles dz = without_trace(inverse * way_z);
    const Doubles distance = s.at_infinity ? all_of(infinity) : length;

    Rays rays;
    rays.elsewhere = none;
    Truths idle = {};
    const Doubles inverse_dz = 1 / dz;
    if (s.endless_ground) {
        const Doubles end_z = !s.at_infinity ? to_z : dz == 0 ? z : dz;
        const Doubles in_ground = dz == 0 ? distance : smaller(distance, -z * inverse_dz);
        rays.elsewhere = z < 0 ? in_ground : none;
        idle = end_z < 0;
        rays.elsewhere = idle ? all_of(infinity) : rays.elsewhere;
    }

    const double width = s.width;
    const Doubles u = x * width + 0.5, v = (s.height + 0.5) - y * width;
    // Straight up or down is all but straight: some row has to be the next.
    const Doubles speed = larger(width * size(by_columns ? dx : dy), all_of(1e-9 * width));
    const double sign = backwards ? -1 : 1;
    const Doubles along = by_columns ? u : v, across = by_columns ? v : u;
    const Doubles sideways = by_columns ? -width * dy : width * dx;
    rays.step_length = 1 / speed;
    rays.slide = sideways * rays.step_length;
    rays.rise = dz * rays.step_length;
    const int rows = by_columns ? s.width : s.height, columns = by_columns ? s.height : s.width;

    // In steps from the start.
    Span part{none, distance * speed};
    part.clip(along, all_of(sign), all_of(sign), 0.5, rows + 0.5);
    part.clip(across, sideways, speed / sideways, 0.5, columns + 0.5);
    const Doubles inverse_rise = speed * inverse_dz;
    part.clip(z, dz, inverse_rise, s.floor_z, infinity);
    const Doubles to_top = (s.top_z - z) * inverse_rise;
    const Doubles over_top = dz > 0 ? to_top : (dz == 0) & (z > s.top_z) ? none : all_of(infinity);
    part.begin = dz < 0 ? larger(part.begin, to_top) : part.begin;
    idle |= ~(part.begin < part.end) | (part.begin >= over_top);
    part.begin = idle ? none : part.begin;
    part.end = idle ? none : part.end;

    const Doubles begins = along + sign * part.begin;
    rays.row = idle ? none : sign * floor(sign * begins);
    const Doubles to_row = (rays.row - along) * sign;  // from the start, at most part.begin
    rays.begin = larger(none, part.begin - to_row);
    // Above the top nothing is left to cut a step for.
    const Doubles rows_to_top = smaller(over_top, part.end) - to_row;
    const Doubles end =
        smaller(part.end - to_row,
                over_top < part.end ? larger(all_of(1), ceil(rows_to_top)) : all_of(infinity));
    rays.last = larger(none, ceil(end) - 1);
    const Doubles x0 = across + to_row * rays.slide;
    rays.column = floor(idle ? none : x0);
    rays.x = x0 - rays.column;
    rays.z = z + (to_row + rays.begin) * rays.rise;
    rays.end = rays.last > 0 ? end - rays.last : end - rays.begin;
    rays.last = idle ? all_of(-1) : rays.last;

    const Truths covered = (size(x) <= farthest_start) & (size(y) <= farthest_start) &
                           (size(z) <= farthest_start) & (length <= farthest_light);
    rays.elsewhere = covered ? rays.elsewhere : all_of(__builtin_nan(""));
    rays.last = covered ? rays.last : all_of(-1);
    return rays;
}

}  // namespace
}  // namespace relit::kernels

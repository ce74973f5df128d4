// Rays from anywhere, prepared in double (rays.h) and sorted into packets. For those that march_tile.h
// leaves.
#pragma once

#include "core/visibility/kernels/rays.h"
#include "core/visibility/kernels/steps.h"

namespace relit::kernels {
namespace {

// Sorts rays by kind and then by the row that they start in, so that neighbours cross the same rows
// at the same time. order[starts[k]] is the first of kind k.
RELIT_INLINE void sort(const Scenery& s, const double* from, int count, int* order,
                       int (&starts)[kinds + 1]) {
    constexpr int buckets = 64;  // rows, with those below and above in the outer ones
    int place[kinds * buckets + 1] = {};
    int bucket[max_rays];
    const double middle_u = from[0] * s.width, middle_v = s.height - from[1] * s.width;
    for (int i = 0; i < count; ++i) {
        const double x = from[3 * i], y = from[3 * i + 1];
        const double way_x = s.at_infinity ? s.light[0] : s.light[0] - x;
        const double way_y = s.at_infinity ? s.light[1] : s.light[1] - y;
        const bool by_columns = __builtin_fabs(way_x) > __builtin_fabs(way_y);
        const bool backwards = by_columns ? way_x < 0 : way_y > 0;
        const double row =
            by_columns ? x * s.width - middle_u : (s.height - y * s.width) - middle_v;
        const double shifted = row + buckets / 2;
        const int b = shifted > 0 ? shifted < buckets ? int(shifted) : buckets - 1 : 0;
        bucket[i] = ((by_columns ? 2 : 0) + (backwards ? 1 : 0)) * buckets + b;
    }
    for (int i = 0; i < count; ++i) ++place[bucket[i] + 1];
    for (int b = 0; b < kinds * buckets; ++b) place[b + 1] += place[b];
    for (int kind = 0; kind <= kinds; ++kind) starts[kind] = place[kind * buckets];
    for (int i = 0; i < count; ++i) order[place[bucket[i]]++] = i;
}

// r of the rays `order`, `lanes` of them, all of one kind.
template <bool masked>
RELIT_INLINE void march_lanes(const Scenery& scenery, int kind, const double* from,
                              const int* order, double* r) {
    constexpr int batches = 2;
    const bool by_columns = kind == columns_down || kind == columns_up;
    const bool backwards = kind == rows_up || kind == columns_up;
    Rays rays[batches];
    for (int b = 0; b < batches; ++b) {
        const auto coordinate = [&](int c) { return gather(from + c, order + b * batch); };
        rays[b] =
            prepared(scenery, by_columns, backwards, coordinate(0), coordinate(1), coordinate(2));
    }
    const auto floats = [&](Doubles Rays::*field) {
        Doubles values[batches];
        for (int b = 0; b < batches; ++b) values[b] = rays[b].*field;
        return to_floats(values);
    };
    Bundle bundle;
    bundle.grid = by_columns ? &scenery.by_columns : &scenery.by_rows;
    bundle.sign = backwards ? -1 : 1;
    bundle.clear();
    Packet& p = bundle.packets[0];
    p.last = floats(&Rays::last);
    const Mask idle = p.last < broadcast(0.0f);
    const auto ints = [&](Doubles Rays::*field) {
        return to_ints(select(idle, broadcast(0.0f), floats(field)));
    };
    p.row = ints(&Rays::row);
    p.column = ints(&Rays::column);
    p.x = floats(&Rays::x);
    p.begin = floats(&Rays::begin);
    p.z = floats(&Rays::z);
    p.slide = floats(&Rays::slide);
    p.rise = floats(&Rays::rise);
    p.end = floats(&Rays::end);
    march_alone<masked>(bundle, 0);
    const Floats inside = bundle.inside(0);
    alignas(64) double found[lanes];
    for (int b = 0; b < batches; ++b)
        store(found + b * batch, rays[b].elsewhere + rays[b].step_length * to_doubles(inside, b));
    for (int k = 0; k < lanes; ++k) r[order[k]] = found[k];
}

template <bool masked>
RELIT_INLINE void march_all(const Scenery& scenery, const double* from, int count, double* r) {
    int order[max_rays], starts[kinds + 1];
    sort(scenery, from, count, order, starts);
    for (int kind = 0; kind < kinds; ++kind)
        for (int k = starts[kind]; k < starts[kind + 1]; k += lanes) {
            // The last packet is filled up with its last ray.
            int filled[lanes];
            const int* some = order + k;
            const int left_over = starts[kind + 1] - k;
            if (left_over < lanes) {
                for (int lane = 0; lane < lanes; ++lane)
                    filled[lane] = some[lane < left_over ? lane : left_over - 1];
                some = filled;
            }
            march_lanes<masked>(scenery, kind, from, some, r);
        }
}

void march_list(const Scenery& scenery, const double* from, int count, double* r) {
    if (scenery.masked) march_all<true>(scenery, from, count, r);
    else march_all<false>(scenery, from, count, r);
}

}  // namespace
}  // namespace relit::kernels
